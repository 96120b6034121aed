// The ROS graph: topics with rates, the newest messages of those that are watched, and curves of their numbers.
import { CURVES, Curves } from "./curves.js";
import { tr, translated } from "./language.js";
import { LogConsole } from "./log_console.js";
import { NodeGraph } from "./node_graph.js";
import { Parameters } from "./parameters.js";
import { TopicTree } from "./topic_tree.js";
import { Transforms } from "./transforms.js";

const $ = (id) => document.getElementById(id);
const RENEWAL = 2000;                    // milliseconds: the robot shows for some seconds what a page asks for
const MOST = 12;                         // topics watched at once
const LAYERS = {                         // that each box needs; all but the transforms are of an inspection
  "inspect-box": ["graph", "values"], "parameters-box": ["graph", "parameters"], "log-box": ["log"], "transforms-box": ["frames", "fixed_frames"],
};

export class Inspect {
  // `changed()` is called when other layers are needed.
  constructor(send, changed) {
    Object.assign(this, { send, changed });
    this.watched = [];
    this.graph = null;
    this.panels = new Map();             // by topic
    this.curves = new Curves($("curves"), $("curve-cursor"));
    this.tree = new TopicTree($("topic-list"), (name) => this.toggle(name));
    this.nodes = new NodeGraph();
    this.parameters = new Parameters(send, () => this.renew());
    this.log = new LogConsole();
    this.transforms = new Transforms();
    for (const id of Object.keys(LAYERS)) $(id).ontoggle = () => this.renew();
    $("topic-filter").oninput = () => this.list();
    $("curves-pause").onclick = () => $("curves-pause").setAttribute("aria-pressed", String(this.curves.pause()));
    $("curves-clear").onclick = () => { this.curves.clear(); this.showCurves(); };
    setInterval(() => this.renew(), RENEWAL);
  }

  get boxes() { return $("inspect").checkVisibility() ? Object.keys(LAYERS).filter((id) => $(id).open) : []; }
  get layers() { return this.boxes.flatMap((id) => LAYERS[id]); }

  renew() {
    const boxes = this.boxes, { node } = this.parameters;
    if (boxes.join() !== this.wereOpen) { this.wereOpen = boxes.join(); this.changed(); }
    if (document.hidden || boxes.every((id) => id === "transforms-box")) return;
    const nodes = boxes.includes("parameters-box") && node ? [node] : [];
    this.send({ do: "inspect", topics: boxes.includes("inspect-box") ? this.watched : [], nodes });
  }

  // Watch what an address names.
  restore(topics, curves, node) {
    this.watched = topics.slice(0, MOST);
    for (const curve of curves) if (!this.curves.chosen.includes(curve)) this.curves.toggle(...curve.split(" "));
    if (node !== this.parameters.node) this.parameters.choose(node);
    this.showValues([]);
    this.renew();
  }

  showGraph(graph) {
    this.graph = graph;
    this.parameters.offer(graph?.parameter_nodes ?? []);
    this.nodes.show(graph);
    this.list();
  }

  list() {
    const { topics = [], nodes = [], mismatches = [], problem = "" } = this.graph ?? {};
    const wanted = $("topic-filter").value.trim().toLowerCase();
    const found = topics.filter((topic) => [topic.name, ...topic.types, ...topic.publishers, ...topic.subscriptions].some((text) => text.toLowerCase().includes(wanted)));
    $("graph-note").textContent = translated(problem) || [tr("{nodes} nodes, {topics} topics", { nodes: nodes.length, topics: topics.length }), ...mismatches].join(". ");
    this.tree.show(found, this.watched);
  }

  toggle(name) {
    if (!this.watched.includes(name) && this.watched.length === MOST) {
      $("graph-note").textContent = tr("At most {number} topics are watched at once.", { number: MOST });
      return;
    }
    this.watched = this.watched.includes(name) ? this.watched.filter((one) => one !== name) : [...this.watched, name];
    if (!this.watched.includes(name)) this.curves.forget(name);
    this.list();
    this.showValues([]);
    this.renew();
  }

  showValues(values) {
    const byName = new Map(values.map((value) => [value.name, value]));
    for (const name of this.panels.keys()) if (!this.watched.includes(name)) this.panels.delete(name);
    for (const name of this.watched) {
      if (!this.panels.has(name)) this.panels.set(name, new WatchedTopic(name, () => this.toggle(name), (path) => this.toggleCurve(name, path)));
      const value = byName.get(name);
      if (!value) continue;
      if (value.messages) this.tree.showRate(name, value.hz);
      this.panels.get(name).show(value, this.graph?.topics.find((topic) => topic.name === name));
      this.curves.add(value);
    }
    const boxes = this.watched.map((name) => this.panels.get(name).box);
    if (boxes.some((box, i) => $("watched").children[i] !== box) || boxes.length !== $("watched").children.length) $("watched").replaceChildren(...boxes);
    this.showCurves();
  }

  toggleCurve(topic, path) {
    if (!this.curves.toggle(topic, path)) $("graph-note").textContent = tr("At most {number} curves are drawn at once.", { number: CURVES });
    this.showCurves();
  }

  showCurves() {
    $("curves").hidden = $("curve-row").hidden = !this.curves.any;
    this.curves.draw();
  }
}

// The newest message of a topic as nested lists; a number is a button that draws its curve. The elements stay while
// the message keeps its fields, so that they can be pressed.
class WatchedTopic {
  constructor(name, close, draw) {
    this.draw = draw;
    this.box = document.createElement("div");
    this.rate = document.createElement("small");
    this.problem = document.createElement("p");
    this.shape = "";
    this.leaves = new Map();
    const button = document.createElement("button");
    this.box.className = "watched";
    this.problem.className = "quiet";
    button.className = "close";
    button.textContent = "×";
    button.setAttribute("aria-label", tr("Stop watching {name}", { name }));
    button.onclick = close;
    this.rate.textContent = ` ${tr("waiting for a message")}`;
    this.ends = document.createElement("p");
    this.ends.className = "quiet";
    this.box.append(button, name, this.rate, this.ends, this.problem);
  }

  // `topic` is what the graph has of it, with the nodes at both ends.
  show({ hz, bytes_per_second: bytes, messages, problem, value }, topic) {
    this.ends.textContent = topic ? ends(topic) : "";
    if (messages) this.rate.textContent = ` ${hz.toFixed(1)} Hz, ${(bytes / 1000).toFixed(1)} kB/s`;
    this.problem.textContent = translated(problem);
    if (value === null) return;
    const shape = JSON.stringify(value, (_, part) => (part !== null && typeof part === "object" ? part : typeof part));
    if (shape !== this.shape) this.build(value, shape);
    for (const [path, { element, read }] of this.leaves) element.textContent = shown(read(value));
  }

  build(value, shape) {
    this.shape = shape;
    this.leaves.clear();
    this.list?.remove();
    this.list = this.tree(value, "", (whole) => whole);
    this.box.append(this.list);
  }

  tree(value, path, read) {
    const list = document.createElement("ul");
    for (const [key, part] of Object.entries(value)) {
      const item = document.createElement("li"), at = path ? `${path}.${key}` : key, inner = (whole) => read(whole)[key];
      item.append(`${key}: `, part !== null && typeof part === "object" ? this.tree(part, at, inner) : this.leaf(part, at, inner));
      list.append(item);
    }
    return list;
  }

  leaf(value, path, read) {
    const element = document.createElement(typeof value === "number" ? "button" : "span");
    if (typeof value === "number") {
      element.title = tr("Plot this value");
      element.onclick = () => this.draw(path);
    }
    this.leaves.set(path, { element, read });
    return element;
  }
}

const ends = ({ publishers, subscriptions }) => `${publishers.join(", ")} → ${subscriptions.join(", ")}`;
const shown = (value) => (typeof value === "number" && !Number.isInteger(value) ? value.toPrecision(6) : String(value));
