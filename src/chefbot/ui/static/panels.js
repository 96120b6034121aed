// Text, numbers and buttons beside the map. All text is set as textContent, so that a name cannot become markup.
import { byArrows } from "./keys.js";
import { language, title, tr, translated } from "./language.js";
import { ErrorPlot, length } from "./plot.js";
import { isGuest, RoundCard, stepSentence } from "./round.js";

const $ = (id) => document.getElementById(id);
const text = (id, value) => { if ($(id).textContent !== value) $(id).textContent = value; };
const TABLE = /^table/, SERVED = /^(table|room)/;    // names of places by their kind
const FOR_ENGINEERS = /^(Wire|Node faults): /;   // warnings about which nobody else can do anything
const FOR_MANAGERS = / \/\S/;            // those about files
const reads = (warning, role) => role === "engineer" || !(FOR_ENGINEERS.test(warning) || (role !== "manager" && FOR_MANAGERS.test(warning)));
const SHORT_TIME = { dateStyle: "short", timeStyle: "medium" };
const PICTURES = { map: tr("Map at that moment"), camera: tr("Camera image at that moment") };
const orDash = (value, format) => (value === null || value === undefined ? "–" : format(value));

export class Panels {
  constructor(send) {
    this.send = send;
    this.round = new RoundCard(send);
    this.chosen = [];
    this.shown = {};                     // the status
    this.ordered = null;                 // order sent, delivery status not received since
    this.names = "";
    this.list = [];                      // places with their poses
    this.doors = "";
    this.plot = new ErrorPlot($("plot"));
    this.wire();
  }

  wire() {
    $("deliver").onclick = () => this.deliver();
    $("patrol").onclick = () => this.send({ do: "patrol", places: this.chosen, rounds: 0 }) && this.choose([]);
    $("is-at").onchange = () => this.standsAt($("is-at").value);
    $("follow_me").onclick = () => this.send({ do: "follow" });
    for (const tab of document.querySelectorAll("[data-tab]")) tab.onclick = () => this.open(tab.dataset.tab);
    byArrows($("tabs"), "[data-tab]");
  }

  open(name) {
    for (const tab of document.querySelectorAll("[data-tab]")) {
      tab.setAttribute("aria-selected", String(tab.dataset.tab === name));
      tab.tabIndex = tab.dataset.tab === name ? 0 : -1;
    }
    if (name === "edit-map") $("edit-box").open = true;
    if (name === "inspect") $("inspect-box").open = true;
    for (const panel of document.querySelectorAll(".panel")) panel.classList.toggle("shown", panel.id === name);
    this.plot.draw();
  }

  get tab() { return document.querySelector("[data-tab][aria-selected=true]").dataset.tab; }

  deliver() {
    const tables = this.chosen;
    if (!this.send({ do: "deliver", tables })) return;
    this.ordered = tables;
    this.choose([]);
    $("round").focus({ preventScroll: true });   // the button is disabled now
    $("round").scrollIntoView({ block: "nearest" });
  }

  // The order was refused or may be lost: restore the selection, so that it can be sent again.
  keepOrder() {
    if (this.ordered && this.chosen.length === 0) this.choose(this.kept = this.ordered);
    this.ordered = null;
  }

  // It was not lost, so that it is not sent twice.
  orderArrived() {
    if (this.kept && this.chosen === this.kept) this.choose([]);
    this.kept = null;
  }

  choose(tables) {
    this.chosen = tables;
    for (const button of $("tables").children) {
      const turn = tables.indexOf(button.dataset.name) + 1;
      button.setAttribute("aria-pressed", String(turn > 0));
      button.textContent = turn && tables.length > 1 ? `${turn}. ${title(button.dataset.name)}` : title(button.dataset.name);
    }
    $("deliver").disabled = $("patrol").hidden = tables.length === 0;
    text("deliver", servingLabel(tables));
  }

  places(list) {
    this.list = list;
    const names = JSON.stringify(list.map((place) => place.name));
    if (names === this.names) return;
    this.names = names;
    $("tables").replaceChildren(...list.filter(({ name }) => SERVED.test(name)).map(({ name }) => button(title(name), name, () => this.toggle(name))));
    $("places").replaceChildren(...list.filter(({ name }) => !TABLE.test(name))
      .map(({ name }) => button(title(name), name, () => this.round.go({ do: "go_place", name }, title(name)))));
    this.choose(this.chosen.filter((name) => list.some((place) => place.name === name)));
    $("is-at").replaceChildren(new Option("–", ""), ...list.map(({ name }) => new Option(title(name), name)));
  }

  // Localization starts from the pose of a place.
  standsAt(name) {
    $("is-at").value = "";
    const place = this.list.find((one) => one.name === name);
    if (place) this.send({ do: "initial_pose", x: place.x, y: place.y, yaw: place.yaw });
  }

  // The same places may have other labels now.
  relabel(list) {
    this.names = "";
    this.places(list);
    this.round.relabel();
  }

  toggle(name) {
    this.choose(this.chosen.includes(name) ? this.chosen.filter((other) => other !== name) : [...this.chosen, name]);
  }

  delivery(value) {
    this.ordered = null;
    this.round.show(value);
    this.activity();
  }

  progress(value) {
    $("job").hidden = !value || value.done >= value.total;
    if (!value) return;
    text("job-text", `${translated(value.text)} ${value.done}/${value.total}`);
    $("job-bar").max = value.total;
    $("job-bar").value = value.done;
  }

  robot(value) {
    text("speed", orDash(value, ({ v }) => `${(Math.abs(v) < 0.005 ? 0 : v).toFixed(2)} m/s`));
  }

  status(value) {
    const status = this.shown = value ?? {};
    this.activity();
    text("clock", orDash(status.clock, clock));
    $("rtf-box").hidden = status.real_time_factor == null;
    text("rtf", orDash(status.real_time_factor, (factor) => `× ${factor.toFixed(1)}`));
    text("battery", orDash(status.battery, (percent) => `${Math.round(percent)} %`));
    $("battery-bar").value = status.battery ?? 0;
    text("volts", orDash(status.volts, (volts) => `${volts.toFixed(1)} V`));
    text("navigation", translated(status.navigation) || "–");
    text("pose-probability", orDash(status.pose_probability, (share) => `${Math.min(99, Math.round(100 * share))} %`));
    text("localization", translated(status.localization));
    text("reason", translated(status.reason) || tr("no restriction"));
    const warnings = (status.warnings ?? []).filter((warning) => reads(warning, document.body.dataset.role));
    text("warnings", warnings.map((warning) => translated(warning)).join("\n"));
    $("warnings").hidden = warnings.length === 0;
    this.simulation(status);
  }

  // What the robot does, and why it stands.
  activity() {
    const { phase, reason, stopped } = this.shown, delivery = this.round.value;
    const helpless = isGuest() && (stopped || delivery?.waits_for === "choice");
    const step = helpless || phase === delivery?.step ? stepSentence(delivery, stopped) : translated(phase);
    text("phase", step || tr("Connected."));
    text("last-stop", reason && !helpless ? tr("Why: {reason}", { reason: translated(reason) }) : "");
  }

  // The newest causes of slow-downs, stops, detours and failures, each with its chain.
  causes(list) {
    $("causes-box").hidden = !list.length;
    const opened = new Set([...$("causes").querySelectorAll("details[open]")].map((entry) => entry.dataset.id));
    const earlier = list[0]?.began ? null : list.find((cause) => cause.began);
    $("causes").replaceChildren(...list.flatMap((cause) => {
      const item = document.createElement("li"), entry = document.createElement("details");
      const head = document.createElement("summary"), chain = document.createElement("ol");
      const lasted = cause.ended > cause.time ? `${(cause.ended - cause.time).toFixed(1)} s` : "";
      const began = cause.began ? new Date(cause.began).toLocaleString(language, SHORT_TIME) : clock(cause.time);
      const values = { time: began, effect: translated(cause.effect), lasted, sentence: translated(cause.sentence) };
      head.textContent = lasted ? tr("{time} {effect} {lasted}: {sentence}", values) : tr("{time} {effect}: {sentence}", values);
      chain.replaceChildren(...cause.chain.map((link) => {
        const line = document.createElement("li");
        line.textContent = translated(link);
        return line;
      }));
      entry.dataset.id = String(cause.number || `run ${cause.id}`);
      entry.open = opened.has(entry.dataset.id);
      entry.append(head, chain, ...cause.pictures.map((kind) => momentPicture(cause.number, kind)));
      item.append(entry);
      return cause === earlier ? [heading(tr("Before the last start:")), item] : item;
    }));
  }

  simulation(status) {
    const error = status.localization_error;
    $("error-box").hidden = $("plot").hidden = error == null;
    text("error", orDash(error, length));
    if (error != null && status.clock != null) this.plot.add(status.clock, error);
    this.offerDoors(status.simulation ? status.doors : []);
  }

  offerDoors(doors) {
    const state = JSON.stringify(doors ?? []);
    if (state === this.doors) return;
    this.doors = state;
    $("doors-box").hidden = !doors?.length;
    $("doors").replaceChildren(...(doors ?? []).map(({ name, open }) => {
      const row = document.createElement("div"), label = document.createElement("span");
      row.className = "door";
      label.textContent = `${title(name)}: ${open ? tr("open") : tr("closed")}`;
      row.append(label, button(tr("Open"), name, () => this.send({ do: "open_door", name })),
        button(tr("Close"), name, () => this.send({ do: "close_door", name })));
      return row;
    }));
  }

  camera(blob) {
    const image = $("camera"), before = image.src;
    image.hidden = !blob;
    $("camera-note").hidden = Boolean(blob);
    if (blob) image.src = URL.createObjectURL(blob);
    if (before) URL.revokeObjectURL(before);
  }
}

function heading(sentence) {
  const item = document.createElement("li");
  item.className = "quiet";
  item.textContent = sentence;
  return item;
}

// A picture of the moment in which a cause began; it is loaded when its entry is opened.
function momentPicture(number, kind) {
  const image = document.createElement("img");
  image.alt = PICTURES[kind];
  image.loading = "lazy";
  image.className = "moment";
  image.onerror = () => image.remove();  // viewers may not see it
  image.src = `causes/${number}/${kind}`;
  return image;
}

function servingLabel(tables) {
  if (tables.length === 0) return tr("Choose tables");
  return tables.length === 1 ? tr("Serve {place}", { place: title(tables[0]) }) : tr("Serve {number} tables", { number: tables.length });
}

function button(label, name, action) {
  const one = document.createElement("button");
  one.textContent = label;
  one.dataset.name = name;
  one.onclick = action;
  return one;
}

function clock(seconds) {
  const whole = Math.floor(seconds), two = (value) => String(value).padStart(2, "0");
  const hours = Math.floor(whole / 3600);
  return `${hours ? `${hours}:` : ""}${two(Math.floor(whole / 60) % 60)}:${two(whole % 60)}`;
}
