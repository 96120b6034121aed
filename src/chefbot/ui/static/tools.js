// Tools of the map: pan, navigation goal, initial pose, and changes of the simulated world.

import { byArrows } from "./keys.js";
import { tr } from "./language.js";

export const TOOLS = [
  { id: "look", label: tr("Pan"), hint: "" },
  { id: "goal", label: tr("Go there"), hint: tr("Press the goal position and drag in the goal direction.") },
  { id: "initial_pose", label: tr("Set robot pose"), hint: tr("Press the robot's position and drag in the direction it faces.") },
  { id: "measure", label: tr("Measure"), hint: tr("Press a point and drag to another one."), stays: true, drags: true },
  { id: "inspect_cell", label: tr("Cell"), hint: tr("Press a cell of the global costmap."), stays: true },
  { id: "drop_box", label: tr("Box"), hint: tr("Press the position of the box."), simulation: true },
  { id: "kidnap", label: tr("Kidnap"), hint: tr("Press the robot's new position and drag in its new direction."), simulation: true },
  { id: "place", label: "", hint: tr("Press the position of the place and drag in the direction the robot should face."), panel: true },
  { id: "brush", label: "", hint: tr("Press and drag to draw on the map."), panel: true, stays: true, drags: true, draws: true },
  { id: "crop", label: "", hint: tr("Press a corner of the area to keep and drag to the opposite corner."), panel: true, stays: true, drags: true, draws: true },
  { id: "corner", label: "", hint: tr("Press the corners of the zone one after the other."), panel: true, stays: true },
];
const POINTS = new Set(["drop_box", "inspect_cell"]);                    // without a direction
const SHORT = 12;                        // pixels: a drag shorter than this has no direction

const round = (metres) => Math.round(1000 * metres) / 1000;

export class Tools {
  // `send(command)` is called for a press; `draw(tool, points)` during a drag of a tool that draws, with all its points.
  constructor(view, send, lookingAway, robot, draw) {
    Object.assign(this, { view, send, lookingAway, robot, draw });
    this.tool = TOOLS[0];
    this.pointers = new Map();
    this.drag = null;
    this.views = [];
    this.watch(view);
    this.build();
  }

  // A view with its own camera control (3-D) has `rest(on)`, which disables that control while a tool is in use.
  watch(view) {
    this.views.push(view);
    const canvas = view.canvas;
    canvas.addEventListener("pointerdown", (event) => this.down(event, view));
    canvas.addEventListener("pointermove", (event) => this.move(event));
    canvas.addEventListener("pointerup", (event) => this.up(event));
    canvas.addEventListener("pointercancel", (event) => this.abandon(event));
  }

  build() {
    const box = document.getElementById("tools");
    this.buttons = TOOLS.map((tool) => {
      const button = document.createElement("button");
      button.textContent = tool.label;
      button.setAttribute("role", "radio");
      button.dataset.tool = tool.id;
      button.hidden = Boolean(tool.simulation || tool.panel);    // a panel chooses its tools itself
      button.onclick = () => this.choose(tool.id);
      box.append(button);
      return button;
    });
    byArrows(box, "[role=radio]");
    this.choose("look");
  }

  showSimulationTools(simulation) {
    TOOLS.forEach((tool, i) => { if (tool.simulation) this.buttons[i].hidden = !simulation; });
  }

  // Whether a press of the tool has a direction.
  get directed() { return !POINTS.has(this.tool.id) && !this.tool.stays && this.tool.id !== "look"; }

  // What came of a press, instead of the hint.
  answer(id, sentence) { if (this.tool.id === id) document.getElementById("hint").textContent = sentence; }

  choose(id) {
    this.tool = TOOLS.find((tool) => tool.id === id);
    this.drag = null;
    for (const button of this.buttons) {
      button.setAttribute("aria-checked", String(button.dataset.tool === id));
      button.tabIndex = button.dataset.tool === id ? 0 : -1;
    }
    document.getElementById("hint").textContent = this.tool.hint;
    for (const view of this.views) {
      view.canvas.style.cursor = id === "look" ? "grab" : "crosshair";
      view.rest?.(id !== "look");
      view.refresh();
    }
  }

  down(event, view) {
    if (event.button > 0 || (view.rest && this.tool.id === "look")) return;
    view.canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, view.at(event));
    this.press(view, view.at(event));
  }

  // Press the tool at a pixel of a view.
  press(view, start) {
    const onFloor = view.metres(...start);
    this.view = view;
    this.drag = this.pointers.size < 2 && this.tool.id !== "look" && onFloor ? { start, end: start, points: [onFloor] } : null;
    this.drawOn();
    view.refresh();
  }

  move(event) {
    const before = this.pointers.get(event.pointerId);
    if (!before) return;
    const now = this.view.at(event);
    if (this.drag) this.dragTo(now);
    else if (this.pointers.size === 2) this.pinch(event.pointerId, before, now);
    else if (!this.view.rest) { this.lookingAway(); this.view.pan(now[0] - before[0], now[1] - before[1]); }
    this.pointers.set(event.pointerId, now);
    this.view.refresh();
  }

  dragTo(now) {
    const onFloor = this.view.metres(...now);
    if (!onFloor) return;
    this.drag.end = now;
    this.drag.points.push(onFloor);
    this.drawOn();
  }

  drawOn() {
    if (this.drag && this.tool.draws) this.draw(this.tool.id, this.drag.points.map(({ x, y }) => [round(x), round(y)]));
  }

  pinch(id, before, now) {
    const [, other] = [...this.pointers].find(([key]) => key !== id);
    if (this.view.rest) return;
    const apart = (point) => Math.hypot(point[0] - other[0], point[1] - other[1]);
    this.lookingAway();
    this.view.pan((now[0] - before[0]) / 2, (now[1] - before[1]) / 2);
    if (apart(before) > 0) this.view.zoom(apart(now) / apart(before), (now[0] + other[0]) / 2, (now[1] + other[1]) / 2);
  }

  up(event) {
    this.pointers.delete(event.pointerId);
    this.release();
  }

  release() {
    if (!this.drag) return;
    if (this.tool.draws) {
      this.draw(this.tool.id, null);
      this.drag = null;
      return;
    }
    const { dragged, ...pose } = this.pose();
    const command = POINTS.has(this.tool.id) ? { x: pose.x, y: pose.y } : pose;
    this.send({ do: this.tool.id, ...command, ...(this.tool.panel ? { dragged } : {}) });
    if (!this.tool.stays) this.choose("look");
    this.drag = null;
  }

  abandon(event) {
    this.pointers.delete(event.pointerId);
    this.drag = null;
    this.view.refresh();
  }

  // Without a drag, a goal has the direction of approach, and any other pose the robot's current direction.
  pose() {
    const { start, end } = this.drag;
    const { x, y } = this.view.metres(...start), tip = this.view.metres(...end);
    const robot = this.robot();
    if (Math.hypot(end[0] - start[0], end[1] - start[1]) >= SHORT) return { x, y, yaw: Math.atan2(tip.y - y, tip.x - x), dragged: true };
    if (this.tool.id === "goal" && robot) return { x, y, yaw: Math.atan2(y - robot.y, x - robot.x) };
    return { x, y, yaw: robot?.yaw ?? 0 };
  }
}
