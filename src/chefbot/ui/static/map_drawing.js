// The map itself, changed by a person: strokes of a brush, a crop, a rotation; the robot previews each before it is saved.
import { COLOURS } from "./colours.js";
import { tr, translated } from "./language.js";

const $ = (id) => document.getElementById(id);
const PREVIEW_DELAY = 400;               // milliseconds without a change before the robot previews it
const DEGREE = Math.PI / 180;
const SPACING = 0.5;                     // of the brush's width, between two points of a stroke
const BRUSHES = { wall: () => COLOURS.wall(), free: () => COLOURS.floor(), unknown: () => COLOURS.doubtful() };

export class MapDrawing {
  // `ask(command)` sends a change and returns its id; `choose(tool)` selects a tool; `changed()` draws the map again;
  // `opening()` closes other forms.
  constructor(ask, choose, changed, opening) {
    Object.assign(this, { ask, choose, changed, opening });
    this.strokes = [];                   // lists of [x, y]
    this.crop = null;                    // two corners
    this.kind = "";                      // brush, crop or rotation; empty: nothing is being changed
    this.previewing = this.saving = "";
    for (const [id, kind] of [["brush-start", "brush"], ["crop-start", "crop"], ["rotate-start", "rotation"]]) $(id).onclick = () => this.start(kind);
    $("drawing-form").onsubmit = (event) => { event.preventDefault(); this.save(); };
    $("drawing-cancel").onclick = () => this.close();
    $("stroke-back").onclick = () => { this.strokes.pop(); this.show(); };
    for (const id of ["brush-value", "brush-width", "rotate-angle"]) $(id).oninput = () => this.show();
  }

  start(kind) {
    this.close();
    this.opening();
    this.kind = kind;
    $("drawing-form").hidden = false;
    for (const part of ["brush", "rotation"]) $(`${part}-fields`).hidden = part !== kind;
    $("stroke-back").hidden = kind !== "brush";
    this.choose(kind === "rotation" ? "look" : kind);
    this.show();
    $("drawing-form").scrollIntoView({ block: "nearest" });
  }

  get open() { return this.kind !== ""; }
  get width() { return Number($("brush-width").value); }

  // A drag with the brush continues, or a crop's corner moves.
  dragged(kind, points) {
    if (kind !== this.kind) return;
    if (kind === "crop") this.crop = [points[0], points.at(-1)];
    else this.strokes[this.strokes.length - (this.drawing ? 1 : 0)] = thinned(points, Math.max(0.02, SPACING * this.width));
    this.drawing = true;
    this.changed();
  }

  released() {
    this.drawing = false;
    this.show();
  }

  // The command for what is drawn, null if that is nothing.
  get command() {
    if (this.kind === "brush") return this.strokes.length ? { do: "draw_on_map", strokes: this.strokes, width: this.width, brush: $("brush-value").value } : null;
    if (this.kind === "crop") return this.crop ? { do: "crop_map", x: this.crop[0][0], y: this.crop[0][1], other_x: this.crop[1][0], other_y: this.crop[1][1] } : null;
    const angle = Number($("rotate-angle").value) * DEGREE;
    return angle ? { do: "rotate_map", angle } : null;
  }

  // Show what is drawn, and have the robot preview it.
  show() {
    const command = this.command;
    const wrong = this.kind === "brush" && !$("brush-width").checkValidity();
    $("drawing-save").disabled = !command || wrong;
    $("stroke-back").disabled = !this.strokes.length;
    $("drawing-effects").textContent = wrong ? tr("The width of a brush is 0.05 to 5 m, in steps of 0.05 m.") : "";
    clearTimeout(this.timer);
    if (command && !wrong) this.timer = setTimeout(() => { this.previewing = this.ask({ ...this.command, preview: true }); }, PREVIEW_DELAY);
    this.changed();
  }

  save() {
    clearTimeout(this.timer);
    this.previewing = "";                // its result is still among the last ones
    this.saving = this.ask(this.command);
    $("edit-note").textContent = "";
    $("drawing-effects").textContent = tr("Saving …");
  }

  answer({ id, applied, description }) {
    const text = translated(description);
    if (id && id === this.previewing) $("drawing-effects").textContent = text || tr("No place is cut off.");
    if (!id || id !== this.saving) return;
    this.saving = "";
    if (applied) this.close();
    $("edit-note").textContent = applied ? `${tr("Saved.")} ${text}` : "";
    $("drawing-effects").textContent = applied ? "" : tr("Not saved: {reason}", { reason: text });
  }

  unanswered(id) {
    if (!id || id !== this.saving) return;
    this.saving = "";
    this.refused(tr("No answer. Look at the map, and save again."));
  }

  refused(sentence) { if (this.open) $("drawing-effects").textContent = sentence; }

  close() {
    if (this.open) this.choose("look");
    Object.assign(this, { strokes: [], crop: null, kind: "", drawing: false, saving: "" });
    clearTimeout(this.timer);
    $("drawing-form").hidden = true;
    this.changed();
  }

  paint(context, view) {
    context.save();
    context.lineCap = context.lineJoin = "round";
    context.lineWidth = Math.max(2, this.width * view.scale);
    context.strokeStyle = BRUSHES[$("brush-value").value]();
    for (const points of this.strokes) {
      context.beginPath();
      for (const [x, y] of [points[0], ...points]) context.lineTo(...view.px(x, y));
      context.stroke();
    }
    if (this.crop) {
      const [[left, bottom], [right, top]] = this.crop.map(([x, y]) => view.px(x, y));
      context.lineWidth = 2;
      context.strokeStyle = COLOURS.goal();
      context.strokeRect(left, top, right - left, bottom - top);
    }
    context.restore();
  }
}

// Points that are at least so far apart, with the last one.
function thinned(points, spacing) {
  const kept = [points[0]];
  for (const point of points) if (Math.hypot(point[0] - kept.at(-1)[0], point[1] - kept.at(-1)[1]) >= spacing) kept.push(point);
  return kept.at(-1) === points.at(-1) ? kept : [...kept, points.at(-1)];
}
