// Curves of numbers in messages over the last half minute: pause, and values under the cursor.
const SPAN = 30;                         // seconds shown
export const CURVES = 8;                 // at once
const colour = (i) => `--curve-${i}`;     // of the style sheet, for light and dark
const LEFT = 56, BOTTOM = 18, TOP = 8;   // pixels around the curves

export class Curves {
  constructor(canvas, note) {
    Object.assign(this, { canvas, note, paused: false, cursor: null });
    this.series = new Map();             // points [time, value] by "topic path"
    canvas.onpointermove = (event) => { this.cursor = event.offsetX; this.draw(); };
    canvas.onpointerleave = () => { this.cursor = null; this.draw(); };
  }

  get any() { return this.series.size > 0; }

  // Draw a curve or draw it no more; false if there are too many.
  toggle(topic, path) {
    const key = `${topic} ${path}`;
    if (this.series.delete(key)) return true;
    if (this.series.size === CURVES) return false;
    this.series.set(key, []);
    return true;
  }

  get chosen() { return [...this.series.keys()]; }

  forget(topic) { for (const key of this.series.keys()) if (key.startsWith(`${topic} `)) this.series.delete(key); }
  clear() { this.series.clear(); }

  pause() {
    this.paused = !this.paused;
    return this.paused;
  }

  // Add the numbers of a newest message; an old one that is shown again adds nothing.
  add({ name, time, value }) {
    if (this.paused || value === null) return;
    for (const [key, points] of this.series) {
      const [topic, path] = key.split(" ");
      const number = topic === name ? path.split(".").reduce((part, step) => part?.[step], value) : undefined;
      const last = points.at(-1)?.[0] ?? -1;
      if (typeof number !== "number" || time === last) continue;
      if (time < last) points.length = 0;                  // the robot's computer has started again
      points.push([time, number]);
      while (points[0][0] < time - SPAN) points.shift();
    }
  }

  draw() {
    const { canvas } = this, ratio = window.devicePixelRatio || 1;
    const width = canvas.clientWidth, height = canvas.clientHeight;
    if (!width || !this.any) { this.note.textContent = ""; return; }
    canvas.width = width * ratio;
    canvas.height = height * ratio;
    const context = canvas.getContext("2d");
    context.scale(ratio, ratio);
    const all = [...this.series.values()].flat(), values = all.map(([, value]) => value);
    const now = Math.max(...all.map(([time]) => time), 0);
    const low = Math.min(...values, Infinity), high = Math.max(...values, -Infinity);
    const middle = (low + high) / 2 || 0, half = Math.max((high - low) / 2, 1e-3, Math.abs(middle) * 1e-3) || 1;
    const x = (time) => LEFT + (width - LEFT) * (1 - (now - time) / SPAN);
    const y = (value) => TOP + (height - TOP - BOTTOM) * (0.5 - (value - middle) / (2 * half));
    this.axes(context, width, [middle - half, middle, middle + half].map((value) => [value, y(value)]), height);
    const style = getComputedStyle(canvas);
    [...this.series.values()].forEach((points, i) => {
      context.strokeStyle = style.getPropertyValue(colour(i));
      context.lineWidth = 1.5;
      context.beginPath();
      for (const [time, value] of points) context.lineTo(x(time), y(value));
      context.stroke();
    });
    this.legend(context, now, width, height);
  }

  axes(context, width, marks, height) {
    const style = getComputedStyle(this.canvas);
    context.strokeStyle = style.getPropertyValue("--line");
    context.fillStyle = style.getPropertyValue("--quiet");
    context.font = "11px system-ui, sans-serif";
    for (const [value, at] of marks) {
      context.beginPath(); context.moveTo(LEFT, at); context.lineTo(width, at); context.stroke();
      context.fillText(value.toPrecision(4), 0, at + 4);
    }
    context.fillText(`${SPAN} s`, LEFT, height - 4);
  }

  // Names in the colours of their curves, with the values under the cursor, else the newest.
  legend(context, now, width, height) {
    const time = this.cursor === null ? now : now - SPAN * (1 - (this.cursor - LEFT) / (width - LEFT));
    if (this.cursor !== null) {
      context.beginPath(); context.moveTo(this.cursor, TOP); context.lineTo(this.cursor, height - BOTTOM); context.stroke();
    }
    this.note.replaceChildren(...[...this.series].map(([key, points], i) => {
      const line = document.createElement("span"), value = points.findLast(([at]) => at <= time)?.[1];
      line.style.color = `var(${colour(i)})`;
      line.textContent = `${key}: ${value === undefined ? "–" : value.toPrecision(6)}`;
      return line;
    }));
  }
}
