// The tree of frames as nested lists: each with its pose in its parent and, if it moves, the age of its transform.
import { tr } from "./language.js";

const $ = (id) => document.getElementById(id);
const DEGREES = 180 / Math.PI;

export class Transforms {
  constructor() {
    this.fixed = [];
    this.moving = [];
    this.clock = 0;
    this.shape = "";
    this.notes = new Map();              // by frame
  }

  get open() { return $("transforms-box").open && $("inspect").checkVisibility(); }

  showFixed(frames) { this.fixed = frames; this.show(); }
  showMoving(frames) { this.moving = frames; this.show(); }
  status(status) { this.clock = status?.clock ?? 0; }

  show() {
    if (!this.open) return;
    const frames = [...this.fixed.map((frame) => ({ ...frame, moves: false })), ...this.moving.map((frame) => ({ ...frame, moves: true }))];
    const shape = JSON.stringify(frames.map(({ name, parent }) => [name, parent]));
    if (shape !== this.shape) this.build(frames, shape);
    const newest = Math.max(this.clock, ...this.moving.map(({ time }) => time));
    for (const frame of frames) {
      const note = this.notes.get(frame.name);
      if (note) note.textContent = [pose(frame), frame.moves ? tr("{seconds} s old", { seconds: (newest - frame.time).toFixed(1) }) : tr("fixed")].join(", ");
    }
  }

  // From the roots down; a circle of parents has no root and is not shown.
  build(frames, shape) {
    const children = new Map(), names = new Set(frames.map(({ name }) => name));
    for (const frame of frames) children.set(frame.parent, [...(children.get(frame.parent) ?? []), frame]);
    this.shape = shape;
    this.notes.clear();
    const branch = (name) => {
      const item = document.createElement("li"), note = document.createElement("small"), list = document.createElement("ul");
      item.append(name, " ", note);
      this.notes.set(name, note);
      list.append(...(children.get(name) ?? []).map((frame) => branch(frame.name)));
      if (list.children.length) item.append(list);
      return item;
    };
    $("transforms").replaceChildren(...[...children.keys()].filter((name) => !names.has(name)).map(branch));
  }
}

// Position in metres, and roll, pitch and yaw in degrees; what is zero is left out.
function pose({ at, turn: [x, y, z, w] }) {
  const angles = [
    Math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
    Math.asin(Math.max(-1, Math.min(1, 2 * (w * y - z * x)))),
    Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
  ];
  const named = [...["x", "y", "z"].map((name, i) => [name, at[i].toFixed(3), "m"]),
    ...["roll", "pitch", "yaw"].map((name, i) => [name, (angles[i] * DEGREES).toFixed(1), "°"])];
  return named.filter(([, value]) => Number(value)).map(([name, value, unit]) => `${name} ${value} ${unit}`).join(", ") || "0";
}
