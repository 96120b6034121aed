// STOP at the foot of the page: what it shows is what the robot's base has confirmed, and an alarm where it has not.
import { StopPress } from "./stop.js";

const $ = (id) => document.getElementById(id);
const text = (id, words) => { if ($(id).textContent !== words) $(id).textContent = words; };
const WORDS = { free: "STOP", "not confirmed": "STOP: not confirmed", asked: "STOP: not confirmed", stopped: "STOPPED" };
const VIBRATION = [300, 150, 300], VIBRATE_AGAIN = 1500;

export class StopButton {
  // `resume()` is called when a person releases a STOP that is latched; `pressing()` before every press.
  constructor(send, pressing) {
    this.press = new StopPress(send, () => this.show());
    this.send = send;
    this.vibrated = -Infinity;
    const stop = () => { pressing(); this.press.press(); };
    $("stop").onpointerdown = stop;                                       // at the touch, not at its end
    $("stop").onclick = (event) => { if (event.detail === 0) stop(); };   // by keyboard
    window.addEventListener("keydown", (event) => { if (event.key === "Escape" && !event.repeat) stop(); }, true);
    $("resume").onclick = () => this.release();
    this.show();
  }

  take(view) { this.press.take(view); }

  connected() { this.press.again(); }

  release() {
    if (this.press.id) this.press.withdraw();
    else this.send({ do: "resume", pressed: this.press.view.pressed });
  }

  show() {
    const { state, alarmed } = this.press;
    document.body.classList.toggle("stopped", state !== "free");
    document.body.classList.toggle("alarmed", alarmed);
    text("stop", WORDS[state]);
    text("resume", state === "not confirmed" ? "Withdraw this STOP" : "Resume");
    $("resume").hidden = state === "free";
    $("alarm").hidden = !alarmed;
    if (alarmed && performance.now() - this.vibrated > VIBRATE_AGAIN) {
      this.vibrated = performance.now();
      if (navigator.userActivation?.hasBeenActive ?? true) navigator.vibrate?.(VIBRATION);
    }
  }
}
