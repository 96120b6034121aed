// The emergency stop button: shows the state that the drive base has confirmed, and an alarm while it has not.
import { tr } from "./language.js";
import { StopPress } from "./stop.js";

const $ = (id) => document.getElementById(id);
const text = (id, value) => { if ($(id).textContent !== value) $(id).textContent = value; };
const LABELS = {
  free: tr("STOP"), "not confirmed": tr("STOP: not confirmed"), requested: tr("STOP: not confirmed"), stopped: tr("STOPPED"),
};
const VIBRATION = [300, 150, 300], VIBRATION_PERIOD = 1500;

export class StopButton {
  // `pressing()` is called before every press.
  constructor(send, pressing) {
    this.press = new StopPress(send, () => this.show());
    this.send = send;
    this.vibrated = -Infinity;
    const stop = () => { pressing(); this.press.press(); };
    $("stop").onpointerdown = stop;                                       // when touched, not when released
    $("stop").onclick = (event) => { if (event.detail === 0) stop(); };   // by keyboard
    const recording = () => document.body.classList.contains("recording");   // of a robot that nobody can stop here
    window.addEventListener("keydown", (event) => { if (event.key === "Escape" && !event.repeat && !recording()) stop(); }, true);
    $("release-stop").onclick = () => this.release();
    this.show();
  }

  take(view) { this.press.take(view); }

  // The robot does not admit this browser, so that nobody here knows whether it is stopped.
  unknown() { this.press.take({ stopped: false, requested: false, confirmed: [], pressed: "" }); }

  connected() { this.press.repeat(); }

  release() {
    if (this.press.id) this.press.withdraw();
    else this.send({ do: "release_stop", pressed: this.press.view.pressed });
  }

  show() {
    const { state, alarmed } = this.press;
    document.body.classList.toggle("stopped", state !== "free");
    document.body.classList.toggle("alarmed", alarmed);
    text("stop", LABELS[state]);
    text("release-stop", state === "not confirmed" ? tr("Cancel the stop request") : tr("Release STOP"));
    const mayRelease = document.body.dataset.role !== "guest" || state === "not confirmed";
    $("release-stop").hidden = state === "free" || !mayRelease;
    $("alarm").hidden = !alarmed;
    if (alarmed && performance.now() - this.vibrated > VIBRATION_PERIOD) {
      this.vibrated = performance.now();
      if (navigator.userActivation?.hasBeenActive ?? true) navigator.vibrate?.(VIBRATION);
    }
  }
}
