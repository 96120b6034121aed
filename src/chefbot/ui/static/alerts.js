// Sound, vibration and a notification when the robot needs a person: it waits for one, has failed, or its battery is low.
import { tr } from "./language.js";
import { isGuest, stepSentence } from "./round.js";

const KEY = "chefbot-alerts", LOW_BATTERY = 20;          // percent
const NOTE = 0.18, VOLUME = 0.2;         // seconds, share of the loudest
const GRADES = {                         // notes in hertz, vibration in milliseconds
  news: { notes: [660], vibration: [100] },                       // worth knowing
  call: { notes: [660, 880], vibration: [200, 100, 200] },        // the robot waits for a person
  failure: { notes: [880, 660, 880, 660], vibration: [400, 100, 400, 100, 400] },
};

export class Alerts {
  constructor(box) {
    this.box = box;
    this.waits = null;                   // null: nothing received yet, so nothing is new
    this.inRound = false;
    this.battery = null;
    this.audio = null;
    box.checked = recall() === "on";
    box.onchange = () => this.turn(box.checked);
    // Browsers play sound only after the page was touched.
    window.addEventListener("pointerdown", () => { if (box.checked) this.prepare(); });
  }

  turn(on) {
    remember(on ? "on" : "off");
    if (!on) return;
    this.prepare();
    if ("Notification" in window && Notification.permission === "default") Notification.requestPermission();
    this.sound(GRADES.call.notes);
  }

  prepare() {
    this.audio ??= new AudioContext();
    if (this.audio.state === "suspended") this.audio.resume();
  }

  delivery(value) {
    const waits = isGuest() && value?.state !== "waiting" ? "" : value?.waits_for ?? "", before = this.waits;
    this.waits = `${waits} ${value?.place ?? ""}`;
    if (before !== null && waits && this.waits !== before) this.give(stepSentence(value, false));
    const ended = this.inRound && !value?.round_active;
    this.inRound = Boolean(value?.round_active);
    if (ended && value?.unserved.length) this.give(stepSentence(value, false));
  }

  status(value) {
    const battery = value?.battery ?? null, before = this.battery;
    this.battery = battery;
    if (before !== null && battery !== null && before >= LOW_BATTERY && battery < LOW_BATTERY) {
      this.give(tr("The battery has {percent} % left.", { percent: Math.round(battery) }), "news");
    }
  }

  give(sentence, grade = "call") {
    if (!this.box.checked) return;
    const { notes, vibration } = GRADES[grade];
    this.sound(notes);
    if (navigator.userActivation?.hasBeenActive ?? true) navigator.vibrate?.(vibration);
    if (document.hidden && "Notification" in window && Notification.permission === "granted") this.notify(sentence);
  }

  // Chrome on Android shows notifications of a service worker only.
  async notify(sentence) {
    const options = { body: sentence, icon: "icon.svg", tag: "chefbot", renotify: true };
    const worker = await navigator.serviceWorker?.getRegistration();
    if (worker?.active) await worker.showNotification("Chefbot", options);
    else new Notification("Chefbot", options);
  }

  sound(notes) {
    if (this.audio?.state !== "running") return;
    notes.forEach((frequency, i) => {
      const tone = this.audio.createOscillator(), volume = this.audio.createGain(), from = this.audio.currentTime + i * NOTE;
      tone.frequency.value = frequency;
      volume.gain.setValueAtTime(VOLUME, from);
      volume.gain.exponentialRampToValueAtTime(0.001, from + NOTE);
      tone.connect(volume).connect(this.audio.destination);
      tone.start(from);
      tone.stop(from + NOTE);
    });
  }
}

// A browser that blocks cookies refuses this, too; the choice then lasts as long as the page.
function recall() {
  try { return localStorage.getItem(KEY); } catch { return null; }
}

function remember(choice) {
  try { localStorage.setItem(KEY, choice); } catch { return; }
}
