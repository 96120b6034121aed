// The bar of a recording: play or pause, a slider over its time, the rate.
import { tr, translated } from "./language.js";

const $ = (id) => document.getElementById(id);
const RATES = [1, 2, 5, 10];

export class Playback {
  constructor(send) {
    this.send = send;
    this.rate = 1;                       // to go on with after a pause
    this.dragging = false;
    $("playback-run").onclick = () => send({ do: "playback", rate: this.value?.rate ? 0 : this.rate });
    $("playback-time").oninput = () => { this.dragging = true; this.showTime(Number($("playback-time").value)); };
    $("playback-time").onchange = () => {
      this.dragging = false;
      send({ do: "playback", time: Number($("playback-time").value) });
    };
    $("playback-rate").replaceChildren(...RATES.map((rate) => new Option(`× ${rate}`, String(rate))));
    $("playback-rate").onchange = () => {
      this.rate = Number($("playback-rate").value);
      if (this.value?.rate) send({ do: "playback", rate: this.rate });
    };
  }

  show(value) {
    this.value = value;
    $("playback").hidden = !value;
    document.body.classList.toggle("recording", Boolean(value));
    if (!value) return;
    $("playback-title").textContent = translated(value.title);
    $("playback-run").textContent = value.rate ? tr("Pause") : tr("Play");
    $("playback-time").max = value.length;
    if (this.dragging) return;
    $("playback-time").value = value.time;
    this.showTime(value.time);
  }

  showTime(seconds) {
    $("playback-position").textContent = tr("{time} of {length}", { time: clock(seconds), length: clock(this.value.length) });
  }
}

function clock(seconds) {
  const tenths = Math.round(10 * seconds), two = (value) => String(value).padStart(2, "0");
  return `${two(Math.floor(tenths / 600))}:${two(Math.floor(tenths / 10) % 60)}.${tenths % 10}`;
}
