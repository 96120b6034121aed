// A press of STOP until the robot's base has confirmed it: sent again and again, and an alarm when it takes too long.

const AGAIN = 250, ALARM = 300;          // milliseconds
const KEPT = "chefbot-stop";             // a page that is loaded again goes on asking

export class StopPress {
  // `send(command)` gives a command; `changed()` is called whenever `state` or `alarmed` may have changed.
  constructor(send, changed, store = sessionStorage) {
    Object.assign(this, { send, changed, store });
    this.view = { stopped: false, asked: false, confirmed: [], pressed: "" };
    this.id = store.getItem(KEPT);
    this.since = performance.now();
    this.sent = -Infinity;
    setInterval(() => this.tick(), 50);
  }

  // not confirmed (pressed here), asked (pressed elsewhere, not confirmed), stopped, or free
  get state() {
    if (this.id) return "not confirmed";
    return this.view.stopped ? "stopped" : this.view.asked ? "asked" : "free";
  }

  get alarmed() { return Boolean(this.id) && performance.now() - this.since > ALARM; }

  press() {
    if (!this.id) {
      this.id = Array.from(crypto.getRandomValues(new Uint32Array(3)), (part) => part.toString(36)).join("-");
      this.since = performance.now();
      this.store.setItem(KEPT, this.id);
    }
    this.again();
    this.changed();
  }

  // It shall not count any more, unless the base has it: then it stays, and Resume releases it.
  withdraw() {
    this.send({ do: "withdraw", id: this.id });
    this.forget();
  }

  // What the base says. Only a word about this very press confirms it: "stopped" may be old.
  take(view) {
    this.view = view ?? this.view;
    if (this.id && this.view.confirmed.includes(this.id)) this.forget();
    this.changed();
  }

  // On every new connection, and every quarter of a second while there is one.
  again() {
    this.sent = performance.now();
    if (this.id) this.send({ do: "stop", id: this.id });
  }

  tick() {
    if (!this.id) return;
    if (performance.now() - this.sent >= AGAIN) this.again();
    this.changed();
  }

  forget() {
    this.id = null;
    this.store.removeItem(KEPT);
    this.changed();
  }
}
