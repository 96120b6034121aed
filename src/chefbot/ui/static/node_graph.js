// The nodes of the ROS graph as a picture over the map, with the topics between them; a node that is pressed names its own.
import { tr } from "./language.js";
import { nodeColumns } from "./node_layout.js";
import { Overlay } from "./overlay.js";

const $ = (id) => document.getElementById(id);
const SVG = "http://www.w3.org/2000/svg";
const BOX = { width: 168, height: 28 }, GAP = { x: 72, y: 14 }, MARGIN = 16;
const LETTER = 7;                        // pixels of a letter's width, about
const EVERYWHERE = /^\/(rosout|parameter_events|tf|tf_static|clock)$/;   // topics that would join nearly all nodes

export class NodeGraph {
  constructor() {
    this.graph = null;
    this.chosen = "";
    this.shape = "";
    this.overlay = new Overlay("node-graph", () => this.draw());
  }

  show(graph) {
    this.graph = graph;
    this.draw();
  }

  draw() {
    if (!this.overlay.open || !this.graph) return;
    const edges = joinedNodes(this.graph.topics), nodes = this.graph.nodes.filter((node) => edges.all.has(node));
    const shape = JSON.stringify([nodes, [...edges.topics]]);
    if (shape !== this.shape) {
      this.shape = shape;
      this.build(nodes, edges);
    }
    this.mark();
  }

  build(nodes, edges) {
    const columns = nodeColumns(nodes, edges.targets), place = places(columns), picture = $("node-graph-picture");
    const width = columns.length * (BOX.width + GAP.x) - GAP.x + 2 * MARGIN;
    const height = Math.max(...columns.map((column) => column.length), 1) * (BOX.height + GAP.y) - GAP.y + 2 * MARGIN;
    picture.setAttribute("viewBox", `0 0 ${width} ${height}`);
    Object.assign(picture.style, { width: `${width}px`, height: `${height}px` });
    const lines = [...edges.topics.keys()].map((key) => line(key.split(" "), place));
    picture.replaceChildren(...lines, ...nodes.map((node) => this.box(node, place.get(node))));
  }

  box(node, [x, y]) {
    const group = element("g", { transform: `translate(${x} ${y})`, role: "button", tabindex: 0, "data-node": node });
    const text = element("text", { x: BOX.width / 2, y: BOX.height / 2 });
    group.ariaLabel = node;
    text.textContent = shortened(node);
    group.append(element("rect", { width: BOX.width, height: BOX.height, rx: 6 }), text);
    group.onclick = () => this.choose(node);
    group.onkeydown = (event) => {
      if (event.key !== "Enter" && event.key !== " ") return;
      event.preventDefault();
      this.choose(node);
    };
    return group;
  }

  choose(node) {
    this.chosen = this.chosen === node ? "" : node;
    this.mark();
  }

  // Of the chosen node, its lines stand out and its topics are listed.
  mark() {
    const { chosen } = this, picture = $("node-graph-picture");
    picture.classList.toggle("marked", Boolean(chosen));
    for (const part of picture.children) {
      const { node, from, to } = part.dataset;
      part.classList.toggle("chosen", Boolean(chosen) && [node, from, to].includes(chosen));
    }
    const list = (kind) => this.graph.topics.filter((topic) => topic[kind].includes(chosen)).map(({ name }) => name).join(", ") || "–";
    $("node-graph-text").textContent = chosen ? tr("{node} receives {received}; it sends {sent}.", { node: chosen, received: list("subscriptions"), sent: list("publishers") })
      : tr("Press a node to see its topics. Topics that nearly every node has are left out.");
  }
}

// Which node sends to which, by which topics, and all nodes that send or receive something.
function joinedNodes(topics) {
  const targets = new Map(), joined = new Map(), all = new Set();
  for (const { name, publishers, subscriptions } of topics) {
    if (EVERYWHERE.test(name)) continue;
    for (const from of publishers) {
      for (const to of subscriptions) {
        if (from === to) continue;
        const key = `${from} ${to}`;
        joined.set(key, [...(joined.get(key) ?? []), name]);
        if (joined.get(key).length === 1) targets.set(from, [...(targets.get(from) ?? []), to]);
        all.add(from).add(to);
      }
    }
  }
  return { targets, topics: joined, all };
}

// The upper left corner of each node's box; columns are centred.
function places(columns) {
  const tallest = Math.max(...columns.map((column) => column.length), 1);
  return new Map(columns.flatMap((column, i) => column.map((node, k) => [node, [
    MARGIN + i * (BOX.width + GAP.x), MARGIN + (k + (tallest - column.length) / 2) * (BOX.height + GAP.y),
  ]])));
}

// A curve from the right side of a box to the left side of another.
function line([from, to], place) {
  const [x, y] = place.get(from), [u, v] = place.get(to), middle = BOX.height / 2, bend = GAP.x * 0.6;
  const start = x + BOX.width, path = `M${start} ${y + middle} C${start + bend} ${y + middle} ${u - bend} ${v + middle} ${u} ${v + middle}`;
  return element("path", { d: path, "data-from": from, "data-to": to, "marker-end": "url(#node-graph-tip)" });
}

function shortened(name) {
  const most = Math.floor(BOX.width / LETTER);
  return name.length > most ? `…${name.slice(1 - most)}` : name;
}

function element(kind, attributes) {
  const one = document.createElementNS(SVG, kind);
  for (const [name, value] of Object.entries(attributes)) one.setAttribute(name, value);
  return one;
}
