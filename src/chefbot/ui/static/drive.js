// Driving by hand: joystick, keys, gamepad. Whatever is held is repeated; whatever lets go sends a zero.

const PERIOD = 100;                      // milliseconds; the server lets the robot stand after 300 without a word
const DEAD_ZONE = 0.08;
const KEYS = {
  i: [1, 0], u: [1, 1], o: [1, -1], j: [0, 1], l: [0, -1], k: [0, 0], m: [-1, -1], ",": [-1, 0], ".": [-1, 1],
  arrowup: [1, 0], arrowdown: [-1, 0], arrowleft: [0, 1], arrowright: [0, -1],
};

export class Driver {
  constructor(send) {
    this.send = send;
    this.held = new Set();
    this.stick = null;
    this.moving = false;
    this.limit = document.getElementById("limit");
    const stick = document.getElementById("stick");
    this.watchStick(stick, document.getElementById("knob"));
    this.watchKeys(stick);
    this.limit.oninput = () => { document.getElementById("limit-text").textContent = `${this.limit.value} %`; };
    for (const kind of ["blur", "pagehide", "contextmenu"]) window.addEventListener(kind, () => this.release());
    document.addEventListener("visibilitychange", () => { if (document.hidden) this.release(); });
    setInterval(() => this.repeat(), PERIOD);
  }

  watchStick(stick, knob) {
    const follow = (event) => {
      const box = stick.getBoundingClientRect(), reach = box.width / 2;
      let x = (event.clientX - box.left - reach) / reach, y = (event.clientY - box.top - reach) / reach;
      const far = Math.max(1, Math.hypot(x, y));
      [x, y] = [x / far, y / far];
      knob.style.transform = `translate(${x * reach * 0.7}px, ${y * reach * 0.7}px)`;
      this.stick = [settle(-y), settle(-x)];
    };
    const drop = () => { this.dropStick(); this.repeat(); };
    this.dropStick = () => { this.stick = null; knob.style.transform = ""; stick.classList.remove("held"); };
    stick.addEventListener("pointerdown", (event) => {
      stick.focus({ preventScroll: true });
      stick.setPointerCapture(event.pointerId);
      stick.classList.add("held");
      follow(event);
      this.repeat();
    });
    stick.addEventListener("pointermove", (event) => { if (this.stick) follow(event); });
    for (const kind of ["pointerup", "pointercancel", "lostpointercapture"]) stick.addEventListener(kind, drop);
  }

  // Only while the pad has the focus: anywhere else keys do what they do on every page.
  watchKeys(pad) {
    pad.addEventListener("keydown", (event) => {
      const key = event.key.toLowerCase();
      if (!(key in KEYS) || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      if (!event.repeat) { this.held.add(key); this.repeat(); }
    });
    pad.addEventListener("keyup", (event) => { if (this.held.delete(event.key.toLowerCase())) this.repeat(); });
    pad.addEventListener("blur", () => this.release());
  }

  // Everything is let go: lost focus, lost connection, hidden page.
  release() {
    this.held.clear();
    this.dropStick();
    this.repeat();
  }

  wanted() {
    if (this.held.has("k")) return [0, 0];
    const sum = [...this.held].map((key) => KEYS[key]).reduce((a, b) => [a[0] + b[0], a[1] + b[1]], [0, 0]);
    const [v, w] = this.stick ?? (this.held.size ? sum.map(unit) : gamepad());
    return [v * this.limit.value / 100, w * this.limit.value / 100];
  }

  repeat() {
    const [v, w] = this.wanted();
    const moving = v !== 0 || w !== 0;
    if (moving || this.moving) this.send({ do: "drive", v, w });
    this.moving = moving;
  }
}

// The left stick, while a shoulder button is held.
function gamepad() {
  const pad = [...(navigator.getGamepads?.() ?? [])].find((one) => one?.connected);
  if (!pad || document.hidden || !(pad.buttons[4]?.pressed || pad.buttons[5]?.pressed)) return [0, 0];
  return [settle(-pad.axes[1]), settle(-pad.axes[0])];
}

const unit = (value) => Math.max(-1, Math.min(1, value));
const settle = (value) => (Math.abs(value) < DEAD_ZONE ? 0 : unit(value));
