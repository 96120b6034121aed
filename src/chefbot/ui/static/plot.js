// The localization error over the last minutes of the robot's clock.

import { tr } from "./language.js";

const SPAN = 120;                        // seconds shown
const STEP = 0.2;                        // seconds between kept points

export class ErrorPlot {
  constructor(canvas) {
    this.canvas = canvas;
    this.points = [];
  }

  add(clock, error) {
    const last = this.points.at(-1);
    if (last && clock < last[0]) this.points = [];           // a new run
    if (last && clock >= last[0] && clock - last[0] < STEP) return;
    this.points.push([clock, error]);
    this.points = this.points.filter(([time]) => time > clock - SPAN);
    this.draw();
  }

  draw() {
    const { canvas } = this, ratio = window.devicePixelRatio || 1;
    const width = canvas.clientWidth, height = canvas.clientHeight;
    if (!width) return;
    canvas.width = width * ratio;
    canvas.height = height * ratio;
    const context = canvas.getContext("2d");
    context.scale(ratio, ratio);
    const style = getComputedStyle(canvas);
    const top = ceiling(Math.max(0.05, ...this.points.map(([, error]) => error)));
    this.axes(context, style, width, height, top);
    this.curve(context, style, width, height, top);
  }

  axes(context, style, width, height, top) {
    context.strokeStyle = style.getPropertyValue("--line");
    context.fillStyle = style.getPropertyValue("--quiet");
    context.font = "11px system-ui, sans-serif";
    for (const share of [0, 0.5, 1]) {
      const y = 8 + (height - 24) * (1 - share);
      context.beginPath(); context.moveTo(40, y); context.lineTo(width, y); context.stroke();
      context.fillText(top < 1 ? `${100 * share * top} cm` : length(share * top), 0, y + 4);
    }
    context.fillText(tr("last {number} minutes", { number: SPAN / 60 }), 40, height - 2);
  }

  curve(context, style, width, height, top) {
    const now = this.points.at(-1)?.[0] ?? 0;
    context.strokeStyle = style.getPropertyValue("--accent");
    context.lineWidth = 1.5;
    context.beginPath();
    for (const [time, error] of this.points) {
      context.lineTo(40 + (width - 40) * (1 - (now - time) / SPAN), 8 + (height - 24) * (1 - error / top));
    }
    context.stroke();
  }
}

export const length = (metres) => (metres < 1 ? `${Math.round(100 * metres)} cm` : `${metres.toFixed(1)} m`);
const ceiling = (value) => [0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10].find((top) => top >= value) ?? Math.ceil(value);
