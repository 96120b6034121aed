// The words beside the model: fixed frame, what is shown, joints, links with their masses.
import { tr } from "../language.js";

const $ = (id) => document.getElementById(id);

export const SWITCHES = [
  ["solids", tr("Solids"), true], ["axes", tr("Frames"), true], ["names", tr("Names"), false], ["cloud", tr("Depth camera"), true], ["walls", tr("Walls"), true],
];
const FIXED = ["map", "odom", "base_link"];

export class Panel {
  constructor({ changed, moved, chosen }) {
    this.moved = moved;
    this.chosen = chosen;
    this.on = Object.fromEntries(SWITCHES.map(([key, , on]) => [key, on]));
    $("model-switches").replaceChildren(...SWITCHES.map(([key, label]) => this.switch(key, label, changed)));
    $("fixed-frame").replaceChildren(...FIXED.map((name) => new Option(name)));
    $("fixed-frame").onchange = changed;
    this.notes = new Map();
    this.sliders = new Map();
    this.rows = new Map();
  }

  get fixed() { return $("fixed-frame").value; }

  // Show one sentence per subject; an empty one removes it.
  showNote(about, sentence) {
    this.notes.set(about, sentence);
    const words = [...this.notes.values()].filter(Boolean).join(" ");
    $("model-note").textContent = words;
    $("model-note").hidden = !words;
  }

  switch(key, label, changed) {
    const row = document.createElement("label"), box = document.createElement("input");
    row.className = "check";
    box.type = "checkbox";
    box.name = key;
    box.checked = this.on[key];
    box.onchange = () => { this.on[key] = box.checked; changed(); };
    row.append(box, label);
    return row;
  }

  describe({ links, joints }) {
    const loose = joints.filter((joint) => joint.kind !== "fixed" && joint.upper > joint.lower);
    $("joints-box").hidden = loose.length === 0;
    this.sliders = new Map(loose.map((joint) => [joint.name, this.slider(joint)]));
    $("joints").replaceChildren(...[...this.sliders.values()].map(({ row }) => row));
    this.list(links.filter(({ mass }) => mass !== null), links.filter(({ mass }) => mass === null));
  }

  slider(joint) {
    const row = document.createElement("label"), input = document.createElement("input"), value = document.createElement("output");
    row.className = "joint";
    const name = document.createElement("span");
    name.textContent = joint.name;
    Object.assign(input, { type: "range", min: joint.lower, max: joint.upper, step: "any", value: 0, name: joint.name });
    const turns = joint.kind !== "prismatic";
    const show = () => { value.textContent = turns ? `${Math.round(input.value * 180 / Math.PI)}°` : `${Number(input.value).toFixed(3)} m`; };
    input.oninput = () => { show(); this.moved(joint.name, Number(input.value)); };
    show();
    row.append(name, input, value);
    return { row, input, show };
  }

  // A joint whose state the robot publishes follows the robot, not the slider.
  follow(joints) {
    for (const [name, position] of Object.entries(joints ?? {})) {
      const slider = this.sliders.get(name);
      if (!slider) continue;
      slider.input.disabled = true;
      slider.input.value = Math.atan2(Math.sin(position), Math.cos(position));
      slider.show();
    }
    $("joints-note").hidden = ![...this.sliders.values()].some(({ input }) => input.disabled);
  }

  list(heavy, light) {
    const total = heavy.reduce((sum, { mass }) => sum + mass, 0);
    $("links-total").textContent = heavy.length ? tr("{number} with mass, {mass}", { number: heavy.length, mass: kilograms(total) }) : "";
    this.rows = new Map([...heavy, ...light].map((link) => [link.name, this.row(link)]));
    $("links").replaceChildren(...this.rows.values());
  }

  row({ name, mass }) {
    const button = document.createElement("button"), words = document.createElement("span"), weight = document.createElement("span");
    words.textContent = name;
    weight.textContent = mass === null ? tr("frame") : kilograms(mass);
    weight.className = "quiet";
    button.dataset.link = name;
    button.onclick = () => this.chosen(name);
    button.append(words, weight);
    return button;
  }

  mark(name) {
    for (const [link, row] of this.rows) row.setAttribute("aria-pressed", String(link === name));
    if (name) this.rows.get(name)?.scrollIntoView({ block: "nearest" });
  }
}

const kilograms = (mass) => (mass < 1 ? `${Math.round(1000 * mass)} g` : `${mass.toFixed(2)} kg`);
