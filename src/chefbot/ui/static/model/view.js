// The 3-D view: the robot's solids in its frames, on a floor, with what it sees. It draws only when something changed.
import { Mesh, MeshBasicMaterial, Raycaster, Vector2, Vector3 } from "three";
import { title, tr } from "../language.js";
import { Body, axesGeometry, origin } from "./body.js";
import { Floor } from "./floor.js";
import { FrameTree } from "./frames.js";
import { Labels } from "./labels.js";
import { Live } from "./live.js";
import { Panel } from "./panel.js";
import { Stage } from "./stage.js";
import { parseUrdf } from "./urdf.js";

const BASE = "base_link";
const AXES = 0.24;                       // length of a frame's axes, of the robot's radius
const SMALL = 0.4;                       // metres: that radius as long as no solids are there
const CLICK = 4;                         // pixels: who moved further meant to turn the picture

export class ModelView {
  constructor(canvas, names, hidden) {
    this.canvas = canvas;
    this.hidden = hidden;
    this.following = true;
    this.stage = new Stage(canvas, () => this.prepare());
    this.frames = new FrameTree();
    this.body = new Body(this.frames);
    this.live = new Live(this.frames);
    this.labels = new Labels(names);
    this.panel = new Panel({
      changed: () => this.refresh(), moved: (joint, position) => this.move(joint, position), chosen: (link) => this.choose(link),
    });
    this.axes = new Map();
    this.geometry = axesGeometry(AXES * SMALL);
    this.places = [];
    this.known = new Map();
    this.links = new Map();
    this.paint = new MeshBasicMaterial({ vertexColors: true, toneMapped: false });
    this.stage.scene.add(this.frames.world);
    this.watchClicks();
  }

  // Return the floor for the map's tools; `aimed` returns the pose being drawn, if any.
  floor(aimed) { return new Floor(this, aimed); }

  async load(url) {
    if (this.loading || this.body.file) return;
    this.loading = true;
    this.panel.showNote("solids", tr("Loading the robot's solids …"));
    try {
      await this.body.load(url);
      this.panel.showNote("solids", "");
    } catch (error) {
      this.panel.showNote("solids", tr("The robot's solids could not be loaded: {error}", { error: error.message }));
    }
    this.loading = false;
    this.assemble();
  }

  // A robot at rest repeats its state ten times a second: unchanged values need no redraw.
  take(layer, value) {
    const taker = TAKERS[layer];
    if (taker) {
      const text = JSON.stringify(value);
      if (this.known.get(layer) === text) return;
      this.known.set(layer, text);
      taker(this, value);
    }
    if (this.live.take(layer, value) || taker) this.refresh();
  }

  describe(text) {
    if (!text) return;
    let model;
    try {
      model = parseUrdf(text);
    } catch (error) {
      return this.panel.showNote("description", error.message);
    }
    this.panel.showNote("description", "");
    this.links = new Map(model.links.map((link) => [link.name, link]));
    this.frames.describe(model.joints);
    this.panel.describe(model);
    this.assemble();
  }

  // Solids and description come in any order; the first picture waits for both.
  assemble() {
    if (!this.links.size) return;
    this.body.attach(this.links, BASE);
    this.frames.settle();
    const ball = this.body.ball();
    if (!ball || this.ball) return;
    this.ball = ball;
    this.geometry = axesGeometry(AXES * ball.radius);
    for (const axes of this.axes.values()) axes.geometry = this.geometry;
    this.seen = null;
    this.stage.look(ball.center, ball.radius, this.heading());
  }

  // Radians, of the robot in the fixed frame.
  heading() {
    const [x, y] = this.frames.group(BASE).matrixWorld.elements;
    return Math.atan2(y, x);
  }

  move(joint, position) {
    this.frames.move(joint, position);
    this.refresh();
  }

  choose(link) {
    this.panel.mark(this.body.choose(link));
    this.refresh();
  }

  follow(on) {
    if (on === this.following) return;
    this.following = on;
    this.refresh();
  }

  // The robot in the middle and as large as at the start.
  home() {
    this.frames.settle();
    const middle = this.ball ? this.body.ball().center : origin(this.frames.group(BASE));
    this.stage.look(middle, this.ball?.radius ?? SMALL, this.heading());
  }

  fit(area) {
    this.follow(false);
    const centre = new Vector3((area.left + area.right) / 2, (area.bottom + area.top) / 2, 0);
    this.frames.settle();
    this.frames.home.localToWorld(centre);
    this.stage.lookDown(centre, Math.max(area.top - area.bottom, (area.right - area.left) / this.stage.camera.aspect));
  }

  refresh() { this.stage.refresh(); }

  repaint(data) {
    this.live.repaint(data);
    this.stage.paintGround();
  }

  // Before each picture: where everything is.
  prepare() {
    this.frames.fixed = this.panel.fixed;
    this.frames.glides.advance();
    if (!this.frames.glides.done) this.refresh();
    this.frames.settle();
    const base = this.frames.has(BASE) ? origin(this.frames.group(BASE)) : new Vector3();
    if (this.following && this.seen) this.stage.shift(base.clone().sub(this.seen));
    this.seen = base;
    this.stage.centre(base);
    this.body.show(this.panel.on.solids);
    this.live.show(this.hiddenLayers());
    this.showAxes();
    this.showNames();
  }

  hiddenLayers() {
    const { cloud, walls } = this.panel.on;
    return new Set([...this.hidden, ...(cloud ? [] : ["depth"]), ...(walls && !this.hidden.has("map") ? [] : ["walls"])]);
  }

  showAxes() {
    for (const [name, group] of this.frames.groups) {
      if (!this.axes.has(name)) this.axes.set(name, this.makeAxes(name));
      const axes = this.axes.get(name);
      axes.visible = this.panel.on.axes;
      axes.matrix.copy(group.matrixWorld);
      axes.matrixWorldNeedsUpdate = true;
    }
  }

  makeAxes(name) {
    const axes = new Mesh(this.geometry, this.paint);
    axes.name = name;
    axes.matrixAutoUpdate = false;
    this.stage.overlay.add(axes);
    return axes;
  }

  showNames() {
    const wanted = this.panel.on.names ? [...this.frames.groups].map(([name, group]) => ({ key: name, text: name, kind: "frame", place: origin(group) })) : [];
    const chosen = this.body.chosen;
    if (chosen && !this.panel.on.names && this.frames.has(chosen)) wanted.push({ key: chosen, text: chosen, kind: "frame", place: origin(this.frames.group(chosen)) });
    if (!this.hidden.has("places")) {
      const map = this.frames.home;
      for (const { name, x, y } of this.places) wanted.push({ key: `place ${name}`, text: title(name), kind: "place", place: map.localToWorld(new Vector3(x, y, 0)) });
    }
    this.stage.camera.updateMatrixWorld();
    this.labels.draw(wanted, this.stage.camera, this.canvas.clientWidth, this.canvas.clientHeight);
  }

  // A click on a solid chooses its link; a drag turns the picture.
  watchClicks() {
    let start = null;
    this.canvas.addEventListener("pointerdown", (event) => { start = [event.offsetX, event.offsetY]; });
    this.canvas.addEventListener("click", (event) => {
      if (start && Math.hypot(event.offsetX - start[0], event.offsetY - start[1]) < CLICK) this.choose(this.at(event.offsetX, event.offsetY));
    });
  }

  at(x, y) {
    const caster = new Raycaster();
    this.stage.camera.updateMatrixWorld();
    caster.setFromCamera(new Vector2(2 * x / this.canvas.clientWidth - 1, 1 - 2 * y / this.canvas.clientHeight), this.stage.camera);
    return this.body.pick(caster);
  }
}

const TAKERS = {
  description: (view, value) => view.describe(value),
  frames: (view, value) => view.frames.update(value),
  fixed_frames: (view, value) => view.frames.update(value),
  joints: (view, value) => {
    view.panel.follow(value);
    view.frames.follow(value);
  },
  places: (view, value) => { view.places = value ?? []; },
  truth: () => {},
  goal: () => {},
};
