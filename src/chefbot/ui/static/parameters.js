// The parameters of a node: those that can be set while it runs first, as sliders where they have two bounds.
import { tr, translated } from "./language.js";

const $ = (id) => document.getElementById(id);
const STEPS = 50;                        // of a slider at least, where the node names no step: powers of ten
const DECADES = 100;                     // ratio of the bounds from which a slider is logarithmic

export class Parameters {
  // `changed()` is called when another node is chosen.
  constructor(send, changed) {
    Object.assign(this, { send, changed });
    this.node = "";
    this.shape = this.outcome = "";
    this.offered = [];
    this.rows = new Map();               // by name: show(value), and the texts that the filter searches
    $("parameter-node").onchange = () => this.choose($("parameter-node").value);
    $("parameter-filter").oninput = () => this.filter();
  }

  choose(node) {
    this.node = node;
    this.offer(this.offered);
    this.shape = "";
    $("parameter-list").replaceChildren();
    $("parameter-note").textContent = node ? tr("waiting for the node") : "";
    this.changed();
  }

  // The nodes that have parameters; one that has ended stays chosen, as it may start again.
  offer(nodes) {
    this.offered = nodes;
    const all = [...new Set([...(this.node ? [this.node] : []), ...nodes])].sort();
    const box = $("parameter-node"), known = [...box.options].map((option) => option.value);
    if (["", ...all].join() !== known.join()) box.replaceChildren(new Option(tr("Choose a node"), ""), ...all.map((name) => new Option(name, name)));
    box.value = this.node;
  }

  show(nodes) {
    const view = nodes.find(({ node }) => node === this.node);
    if (!view) return;
    $("parameter-list").classList.toggle("old", Boolean(view.problem));
    if (view.problem || view.outcome !== this.outcome) $("parameter-note").textContent = translated(view.problem || view.outcome);
    else if ($("parameter-note").textContent === tr("waiting for the node")) $("parameter-note").textContent = "";
    const listed = [...view.parameters].sort((a, b) => a.read_only - b.read_only || a.name.localeCompare(b.name));
    const shape = JSON.stringify(listed.map(({ value, ...rest }) => rest));
    if (shape !== this.shape && !view.problem) this.build(listed, shape);
    const answered = view.outcome !== this.outcome;          // a value that was refused does not stay
    this.outcome = view.outcome;
    if (answered && $("parameter-list").contains(document.activeElement)) document.activeElement.blur();
    for (const { name, value } of view.parameters) this.rows.get(name)?.show(value);
  }

  build(listed, shape) {
    this.shape = shape;
    this.rows = new Map(listed.map((parameter) => [parameter.name, this.row(parameter)]));
    $("parameter-list").replaceChildren(...[...this.rows.values()].map(({ item }) => item));
    this.filter();
  }

  filter() {
    const wanted = $("parameter-filter").value.trim().toLowerCase();
    for (const { item, texts } of this.rows.values()) item.hidden = !texts.includes(wanted);
  }

  row({ name, type, description, read_only, low, high, step }) {
    const item = document.createElement("li"), label = document.createElement("label"), title = document.createElement("span");
    const set = (value) => this.send({ do: "set_parameter", node: this.node, name, value });
    const control = read_only ? fixed() : CONTROLS[type]?.({ set, low, high, step }) ?? list(set, type);
    title.textContent = name;
    label.append(title, ...control.elements);
    item.append(label);
    if (description) {
      const note = document.createElement("small");
      note.textContent = [description, range(low, high)].filter(Boolean).join("; ");
      item.append(note);
    }
    return { item, show: control.show, texts: `${name} ${description}`.toLowerCase() };
  }
}

const range = (low, high) => (low === null && high === null ? "" : `${low ?? "−∞"} … ${high ?? "∞"}`);
const input = (type) => Object.assign(document.createElement("input"), { type });
// A value that somebody is changing is not overwritten.
const unless = (element, write) => (value) => { if (document.activeElement !== element) write(value); };

function fixed() {
  const output = document.createElement("output");
  return { elements: [output], show: (value) => { output.textContent = Array.isArray(value) ? JSON.stringify(value) : String(value); } };
}

function number(whole) {
  return ({ set, low, high, step }) => {
    const box = input("number"), bounded = low !== null && high !== null;
    const apply = (element) => {
      if (element.value !== "" && element.checkValidity()) { set(Number(element.value)); return; }
      $("parameter-note").textContent = element.validationMessage;
      element.reportValidity();
    };
    Object.assign(box, { min: low ?? "", max: high ?? "", step: whole ? step || 1 : "any" });
    box.onchange = () => apply(box);
    if (!bounded) return { elements: [box], show: unless(box, (value) => { box.value = value; }) };
    const slider = input("range"), scale = !whole && !step && low > 0 && high / low >= DECADES ? logarithmic(low, high) : linear(low, high, step || (whole ? 1 : 0));
    Object.assign(slider, scale.range);
    slider.tabIndex = -1;                // the number beside it is enough for the keyboard
    slider.setAttribute("aria-hidden", "true");
    slider.oninput = () => { box.value = scale.value(Number(slider.value)); };
    slider.onchange = () => { slider.oninput(); apply(box); slider.blur(); };
    const show = unless(slider, unless(box, (value) => { slider.value = scale.position(value); box.value = value; }));
    return { elements: [slider, box], show };
  };
}

// How the position of a slider and a value correspond; where bounds are decades apart, by the logarithm.
function linear(low, high, step) {
  return { range: { min: low, max: high, step: step || 10 ** Math.floor(Math.log10((high - low) / STEPS)) }, value: String, position: (value) => value };
}
function logarithmic(low, high) {
  return {
    range: { min: 0, max: 1, step: 1 / STEPS },
    value: (position) => String(Number(Math.min(high, Math.max(low, low * (high / low) ** position)).toPrecision(3))),
    position: (value) => Math.log(value / low) / Math.log(high / low),
  };
}

const CONTROLS = {
  double: number(false),
  integer: number(true),
  bool: ({ set }) => {
    const box = input("checkbox");
    box.onchange = () => set(box.checked);
    return { elements: [box], show: (value) => { box.checked = value; } };
  },
  string: ({ set }) => {
    const box = input("text");
    box.onchange = () => set(box.value);
    return { elements: [box], show: unless(box, (value) => { box.value = value; }) };
  },
};

// An array as JSON.
function list(set) {
  const box = input("text");
  box.onchange = () => {
    try { set(JSON.parse(box.value)); box.setCustomValidity(""); } catch { box.setCustomValidity(tr("Write a list as [1, 2, 3].")); }
    box.reportValidity();
  };
  return { elements: [box], show: unless(box, (value) => { box.value = JSON.stringify(value); }) };
}
