// The view on the robot's own screen, at #kiosk: what the robot wants in large letters, one button, a PIN to leave.
import { title, tr, translated, withoutStop } from "./language.js";

const $ = (id) => document.getElementById(id);
const HASH = "#kiosk";
const DIGITS = [..."1234567890"];

export class Kiosk {
  constructor(send, changed) {
    this.send = send;
    this.changed = changed;
    this.delivery = null;
    this.stopped = false;
    this.locked = "";                    // why the robot admits this browser no more
    this.leaving = null;                 // command that is not answered yet
    $("kiosk-confirm").onclick = () => send({ do: this.press, place: this.delivery.place });
    $("kiosk-leave").onclick = () => this.leave("");
    $("kiosk-keys").replaceChildren(...DIGITS.map((digit) => this.key(digit)));   // a touch screen may have no keyboard
    $("kiosk-erase").onclick = () => { $("kiosk-digits").value = $("kiosk-digits").value.slice(0, -1); };
    $("kiosk-pin").onsubmit = (event) => { event.preventDefault(); this.leave($("kiosk-digits").value); };
    window.addEventListener("hashchange", () => this.follow(location.hash));
    this.turn(location.hash === HASH);
  }

  key(digit) {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = digit;
    button.onclick = () => { if ($("kiosk-digits").value.length < $("kiosk-digits").maxLength) $("kiosk-digits").value += digit; };
    return button;
  }

  // Once entered, the view is left by its button only.
  follow(hash) {
    if (this.on) history.replaceState(null, "", HASH);
    else this.turn(hash === HASH);
  }

  turn(on) {
    this.on = on;
    $("kiosk").hidden = !on;
    $("kiosk-note").textContent = "";
    $("kiosk-pin").hidden = true;
    document.body.classList.toggle("kiosk", on);
    this.changed();
  }

  show(delivery) {
    this.delivery = delivery;
    const { waits_for: waits = "", place = "", state = "", step = "", round_active: active = false, failed = false } = delivery ?? {};
    this.press = waits;
    const confirms = waits === "loaded" || waits === "taken";
    const heading = waits === "taken" && state === "waiting" ? tr("{place}: your food", { place: title(place) }) : TITLES[waits] ?? STATES[state] ?? (failed ? tr("Please call the staff") : tr("No delivery"));
    // who waits for the robot reads from afar where it goes
    const goes = state === "driving" && !waits && step, sentence = translated(step);
    $("kiosk-title").textContent = this.stopped ? tr("Stopped") : goes ? withoutStop(sentence) : heading;
    $("kiosk-text").textContent = waits === "choice" || state === "failed" || (this.stopped && !active) || (goes && !this.stopped) ? "" : sentence;
    $("kiosk-confirm").hidden = !confirms;
    $("kiosk-confirm").textContent = confirms ? PRESSES[state] : "";
  }

  // The emergency stop was pressed or released.
  stop({ stopped }) {
    this.stopped = stopped;
    this.show(this.delivery);
  }

  connected(delivery) {
    this.locked = "";
    this.show(delivery);
  }

  // The link of this browser was revoked.
  lock(sentence) {
    this.locked = translated(sentence);
    this.lost();
  }

  // Nothing can be confirmed without a connection.
  lost() {
    $("kiosk-title").textContent = this.locked ? tr("Please call the staff") : tr("Please wait");
    $("kiosk-text").textContent = this.locked || tr("No connection to the robot.");
    $("kiosk-confirm").hidden = true;
    this.leaving = null;
  }

  // The robot refuses a wrong PIN; if it has answered without a refusal, the view is left.
  leave(pin) {
    const command = { do: "leave_kiosk", pin };
    this.leaving = this.send(command) ? command : null;
    $("kiosk-digits").value = "";
  }

  refused(sentence) {
    $("kiosk-note").textContent = translated(sentence);
    if (!this.leaving) return;
    this.leaving = null;
    $("kiosk-pin").hidden = false;
    $("kiosk-digits").focus();
  }

  done(command) {
    if (command !== this.leaving) return;
    this.leaving = null;
    history.replaceState(null, "", location.pathname);
    this.turn(false);
  }
}

const PRESSES = { loading: tr("Loaded"), waiting: tr("Taken"), unloading: tr("Unloaded") };
const TITLES = { loaded: tr("Load the food"), choice: tr("Please call the staff") };
const STATES = {
  unloading: tr("Unload the food"), driving: tr("On the way"), returning: tr("On the way back"), errand: tr("On the way"),
};
