// The map by keyboard: arrows move a cursor, comma and full stop turn it, Enter presses the tool there.
import { COLOURS } from "./colours.js";
import { title, tr } from "./language.js";
import { arrow } from "./layers.js";

const MOVES = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
const TURNS = { ",": 1, ".": -1 };
const ZOOMS = { "+": 1.25, "=": 1.25, "-": 0.8 };
const STEP = 24, FAST = 5;               // least pixels of a step; steps with the Shift key
const TURN = Math.PI / 12;
const EDGE = 40;                         // pixels between the cursor and the edge of the view
const LENGTH = 60;                       // pixels of the drag that stands for the direction
const KEYS = tr("Keys: arrows move the cursor, comma and full stop turn it, Enter presses.");

export class MapCursor {
  // `data` has the layers; of `actions`, `whole()` shows the whole map, `zoomed()` keeps a scale, `lookAway()` ends following.
  constructor(view, tools, data, actions) {
    Object.assign(this, { view, tools, data, actions });
    this.pose = null;                    // none until a key has moved it
    view.canvas.addEventListener("keydown", (event) => this.key(event));
    view.canvas.addEventListener("focus", () => this.explain());
    view.canvas.addEventListener("blur", () => this.leave());
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || !this.handle(event)) return;
    event.preventDefault();
    this.view.refresh();
  }

  // Returns whether the key means anything here.
  handle({ key, shiftKey }) {
    const steps = shiftKey ? FAST : 1, { tools } = this;
    if (key in ZOOMS) this.zoom(ZOOMS[key]);
    else if (key === "Home") this.actions.whole();
    else if (tools.tool.id === "look") return this.pan(MOVES[key], steps);
    else if (key in MOVES) this.move(MOVES[key], steps);
    else if (key in TURNS && tools.directed) this.turn(TURNS[key]);
    else if (key === "Enter" || key === " ") this.press();
    else return false;
    return true;
  }

  zoom(factor) {
    this.actions.zoomed();
    this.view.zoom(factor, this.view.width / 2, this.view.height / 2);
  }

  pan(move, steps) {
    if (!move) return false;
    this.actions.lookAway();
    this.view.pan(-move[0] * steps * STEP, move[1] * steps * STEP);
    return true;
  }

  move([x, y], steps) {
    const step = steps * roundStep(STEP / this.view.scale);
    this.start();
    this.pose.x += x * step;
    this.pose.y += y * step;
    this.keepInView();
    if (this.tools.drag) this.tools.dragTo(this.pixel);
    this.describe();
  }

  turn(sign) {
    this.start();
    const yaw = this.pose.yaw + sign * TURN;
    this.pose.yaw = Math.atan2(Math.sin(yaw), Math.cos(yaw));
    this.describe();
  }

  // A tool that draws is pressed to begin, and again to end.
  press() {
    const { tools, view } = this;
    this.start();
    if (tools.drag) {
      tools.release();
      return;
    }
    const tool = tools.tool, [x, y] = this.pixel;
    tools.press(view, [x, y]);
    if (tools.directed) tools.dragTo([x + LENGTH * Math.cos(this.pose.yaw), y - LENGTH * Math.sin(this.pose.yaw)]);
    if (!tool.drags) tools.release();
    if (tools.tool.id === "look") this.pose = null;
  }

  // The cursor begins where the robot is, if that is in view.
  start() {
    if (this.pose) return;
    const robot = this.data.get("robot"), { x, y } = this.view.centre;
    this.pose = { x, y, yaw: robot?.yaw ?? 0 };
    if (!robot) return;
    const [px, py] = this.view.px(robot.x, robot.y);
    if (this.isInside(px, py)) Object.assign(this.pose, { x: robot.x, y: robot.y });
  }

  keepInView() {
    const { view } = this, [x, y] = this.pixel;
    if (this.tools.drag || this.isInside(x, y)) return;      // a drag is measured in pixels
    this.actions.lookAway();
    view.pan(clamp(x, view.width) - x, clamp(y, view.height) - y);
  }

  isInside(x, y) { return x === clamp(x, this.view.width) && y === clamp(y, this.view.height); }

  get pixel() { return this.view.px(this.pose.x, this.pose.y); }

  leave() {
    if (this.tools.drag) this.tools.release();
    this.pose = null;
    this.view.refresh();
  }

  // Somebody has come to the map by keyboard with a tool.
  explain() {
    const { tool } = this.tools;
    if (tool.id !== "look" && this.view.canvas.matches(":focus-visible")) this.tools.answer(tool.id, KEYS);
  }

  describe() {
    const { x, y, yaw } = this.pose, [nearest] = (this.data.get("places") ?? [])
      .map((place) => ({ far: Math.hypot(place.x - x, place.y - y), place })).sort((a, b) => a.far - b.far);
    const values = { x: x.toFixed(2), y: y.toFixed(2), degrees: Math.round(yaw * 180 / Math.PI) };
    const where = this.tools.directed ? tr("x {x} m, y {y} m, direction {degrees}°", values) : tr("x {x} m, y {y} m", values);
    const near = nearest ? tr("{metres} m from {place}", { metres: nearest.far.toFixed(1), place: title(nearest.place.name) }) : "";
    const { drag } = this.tools, from = drag && this.view.metres(...drag.start);
    const along = from ? tr("{metres} m from the first point", { metres: Math.hypot(x - from.x, y - from.y).toFixed(2) }) : "";
    this.tools.answer(this.tools.tool.id, [where, near, along].filter(Boolean).join("; "));
  }

  paint(context, view) {
    if (!this.pose || this.tools.tool.id === "look") return;
    const [x, y] = this.pixel, size = 12;
    if (this.tools.directed) arrow(context, view, this.pose, COLOURS.goal(), LENGTH);
    context.save();
    context.strokeStyle = COLOURS.goal();
    context.lineWidth = 2;
    context.beginPath();
    for (const [dx, dy] of [[size, 0], [0, size]]) {
      context.moveTo(x - dx, y - dy);
      context.lineTo(x + dx, y + dy);
    }
    context.stroke();
    context.restore();
  }
}

// The next of 1, 2, 5, 10, ... times a power of ten, so that coordinates stay round.
function roundStep(metres) {
  const power = 10 ** Math.floor(Math.log10(metres));
  return power * [1, 2, 5, 10].find((factor) => factor * power > metres * 0.999);
}

function clamp(value, size) { return Math.min(Math.max(value, EDGE), size - EDGE); }
