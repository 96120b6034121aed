// The delivery round: buttons for what the robot waits for, and the choice between the round and another goal.
import { comma, isolated, language, nameTitle, title, tr, translated, withoutStop } from "./language.js";

const $ = (id) => document.getElementById(id);
const text = (id, value) => { if ($(id).textContent !== value) $(id).textContent = value; };
const DOUBLE_TAP = 400, DOUBT = 4000;    // milliseconds: the second tap that confirms is no part of a double tap
const PATIENCE = 3000;                   // milliseconds in which a connected robot sends the status of its deliveries
const names = (list) => (list ?? []).map((name) => isolated(title(name))).join(comma);

export const isGuest = () => document.body.dataset.role === "guest";

// The current step for the reader: a guest has nothing to press.
export function stepSentence(delivery, stopped) {
  if (!isGuest()) return translated(delivery?.step);
  return stopped ? tr("The robot is stopped. Please call the staff.") : translated(delivery?.guest_step);
}

export class RoundCard {
  constructor(send) {
    this.send = send;
    this.value = null;
    this.queue = this.orders = "[]";
    this.forecast = [];                  // stops that are left, with metres, seconds and battery
    this.rounds = [];                    // of the history
    this.busy = true;                    // whether a round or an order is under way
    this.stopped = false;                // by the emergency stop
    this.since = performance.now();      // when the robot was connected
    for (const press of ["loaded", "taken", "not_taken"]) {
      $(press).onclick = () => send({ do: press, place: this.value?.place ?? "" });
    }
    for (const choice of ["go_on", "kitchen", "end"]) $(choice).onclick = () => send({ do: "choose", choice });
    $("again").onclick = () => send({ do: "deliver", tables: this.value.unserved });
    const cancel = () => send({ do: "cancel" }), cancelAll = confirmed(tr("Cancel everything?"), cancel, () => this.show(this.value));
    $("cancel").onclick = () => (this.several ? cancelAll($("cancel")) : cancel());
    $("shortest").onclick = () => send({ do: "shortest_order", order: this.value.order_id });
    for (const when of ["now", "after", "instead"]) $(`when_${when}`).onclick = () => this.answer(when);
    $("when_not").onclick = () => this.answer("");
  }

  show(value) {
    const waited = this.value?.waits_for === "choice", focused = document.activeElement;
    this.value = value;
    const waits = value?.waits_for ?? "", next = value?.place ? title(value.place) : tr("the next order");
    const late = performance.now() - this.since > PATIENCE;
    text("step", stepSentence(value, this.stopped) || (value || late ? tr("No delivery.") : tr("Connecting to the robot …")));
    text("round-rest", this.rest(value));
    // also while STOP or a choice holds the round: the guest at the table does not wait for that
    $("loaded").hidden = value?.state !== "loading";
    $("taken").hidden = !["waiting", "unloading"].includes(value?.state);
    text("taken", value?.state === "unloading" ? tr("Unloaded") : tr("Taken"));
    $("not_taken").hidden = value?.state !== "waiting";
    for (const choice of ["go_on", "kitchen", "end"]) $(choice).hidden = !value?.choices.includes(choice);
    const again = value?.state === "loading";             // it is there, unless it was moved by hand
    $("go_on").classList.toggle("primary", !again);
    text("go_on", again ? tr("Drive to {place} again", { place: next }) : value?.place ? tr("Go on to {place}", { place: next }) : tr("Start with {place}", { place: next }));
    text("end", value?.round_active ? tr("End the round") : tr("Cancel the next order"));
    this.several = value?.round_active || (value?.orders ?? []).length > 0;
    const question = $("cancel").classList.contains("question");
    if (!question) text("cancel", this.several ? tr("Cancel the round and all orders") : tr("Cancel the current task"));
    $("again").hidden = !value?.unserved.length;
    text("again", tr("Order {places} again", { places: names(value?.unserved) }));
    this.showQueue(value?.queue ?? []);
    this.showOrders(value?.orders ?? []);
    $("shortest").hidden = (value?.queue ?? []).length < 2;
    this.showForecast(this.forecast);
    const busy = !value || value.round_active || value.orders.length > 0;
    if (busy !== this.busy) { this.busy = busy; this.showHistory(this.rounds); }
    document.body.classList.toggle("waits", Boolean(waits) && !isGuest());
    if (waits === "choice" && !waited) $("round").scrollIntoView({ block: "nearest" });   // a phone may show what is below
    if (!value?.round_active) this.answer("");
    if (focused?.hidden && $("round").contains(focused)) $("round").focus();   // the next Tab continues from here
  }

  // The labels of places have changed.
  relabel() {
    this.queue = this.orders = "";
    this.show(this.value);
  }

  // A robot without deliveries sends no status of them.
  connected() {
    this.since = performance.now();
    this.show(this.value);
    setTimeout(() => this.show(this.value), PATIENCE + 1);
  }

  // The tables that are left, each with buttons to serve it earlier and to leave it out.
  showQueue(queue) {
    const state = JSON.stringify(queue);
    if (state === this.queue) return;      // keeps the focus on a button
    this.queue = state;
    const focused = [...$("queue").children].findIndex((item) => item.contains(document.activeElement));
    $("queue").replaceChildren(...queue.map((name, i) => {
      const item = document.createElement("li"), label = document.createElement("span"), details = document.createElement("div");
      label.textContent = title(name);
      label.dir = "auto";                  // what does not fit is left out at the end of the label
      const when = document.createElement("small");
      when.title = tr("Distance, time and battery on arrival");
      const earlier = chip("↑", tr("Serve {place} earlier", { place: title(name) }), () => this.changeQueue(moved(queue, i)));
      const leave = chip("×", tr("Leave out {place}", { place: title(name) }), confirmed(tr("Leave out?"), () => this.changeQueue(queue.filter((_, k) => k !== i))));
      earlier.disabled = i === 0;
      details.append(when, earlier, leave);
      item.append(label, details);
      return item;
    }));
    if (focused >= 0) ($("queue").children[Math.min(focused, queue.length - 1)]?.querySelector("button:last-child") ?? $("round")).focus();
  }

  // The orders that wait for the round, each with a button to cancel it.
  showOrders(orders) {
    const state = JSON.stringify(orders);
    if (state === this.orders) return;
    this.orders = state;
    $("orders").replaceChildren(...orders.map(({ id, places }) => {
      const item = document.createElement("li"), label = document.createElement("span");
      label.textContent = tr("Then: {places}", { places: names(places) });
      label.dir = "auto";
      const cancel = chip("×", tr("Cancel the order: {places}", { places: names(places) }), confirmed(tr("Cancel it?"), () => this.send({ do: "queue", tables: [], order: id })));
      cancel.hidden = !id;
      item.append(label, cancel);
      return item;
    }));
  }

  // Under the step: the distance to the next stop, and when the robot is home. On each chip: when that table is reached.
  showForecast(forecast) {
    this.forecast = forecast;
    const { queue = [], state = "", place = "", round_active: active = false } = this.value ?? {};
    const stops = active ? forecast : [], [next] = stops, last = stops.at(-1), home = last?.reachable ? last : null;
    const drives = next?.place === place && (state === "driving" || state === "returning");
    text("eta", [
      drives && arrival(next),
      home && stops.length > 1 && homeAgain(home),
      home && (drives || stops.length > 1) && (this.stopped || this.value.waits_for === "choice") && tr("Times count from when the robot continues."),
    ].filter(Boolean).join(" "));
    let from = drives ? 1 : 0;
    for (const [i, name] of queue.entries()) {
      const found = stops.findIndex((stop, k) => k >= from && stop.place === name);
      const chip = $("queue").children[i].querySelector("small"), stop = stops[found];
      if (stop) from = found + 1;
      if (stop?.reachable) chip.textContent = [metres(stop.distance), time(stop.time), ...charge(stop)].map(isolated).join(" · ");
      else chip.textContent = stop ? tr("no path on the map") : "";
    }
  }

  // The emergency stop was pressed or released.
  stop({ stopped }) {
    this.stopped = stopped;
    this.show(this.value);
  }

  changeQueue(tables) { this.send({ do: "queue", tables, order: this.value.order_id, seen: this.value.queue }); }

  // The newest rounds first, each with what became of its tables.
  showHistory(rounds) {
    this.rounds = rounds;
    $("history-box").hidden = !rounds.length;
    $("history").replaceChildren(...rounds.map((round) => {
      const item = document.createElement("li"), head = document.createElement("b");
      const began = new Date(round.began).toLocaleString(language, { dateStyle: "short", timeStyle: "short" });
      head.textContent = round.ordered_by ? `${began}, ${round.ordered_by}: ` : `${began}: `;
      const stops = round.stops.map((stop) => tr("{place}: {outcome}", { place: stop.label || nameTitle(stop.place), outcome: stop.outcome ? translated(stop.outcome) : tr("open") }));
      item.append(head, stops.join("; "), round.ended ? "" : `; ${tr("unfinished")}`, ...this.orderAgain(round));
      return item;
    }));
  }

  // A button that orders the tables of a round that have not received their food, if there are some; a round that has
  // no end although the robot is idle was lost by a restart.
  orderAgain({ ended, stops }) {
    const tables = ended || !this.busy ? stops.filter(({ outcome }) => outcome !== "taken").map(({ place }) => place) : [];
    if (!tables.length) return [];
    const button = document.createElement("button");
    button.textContent = tr("Order {places} again", { places: names(tables) });
    button.onclick = () => this.send({ do: "deliver", tables }) && button.remove();
    return [" ", button];
  }

  // Names of the tables that are still to be served; empty without a round.
  unserved() {
    const { state = "", place = "", loaded = false, queue = [], orders = [] } = this.value ?? {};
    const next = loaded && (state === "driving" || state === "waiting") ? [place] : [];
    return names([...next, ...queue, ...orders.flatMap(({ places }) => places)]);
  }

  rest(value) {
    return [
      value?.delivered.length && tr("Taken at: {places}.", { places: names(value.delivered) }),
      value?.errands.length && tr("Then to: {places}.", { places: names(value.errands.map((name) => name || "a point on the map")) }),
      ...(value?.missed ?? []).map((why) => tr("Not served: {reason}.", { reason: withoutStop(translated(why)) })),
    ].filter(Boolean).join(" ");
  }

  // Send a goal; during a round, first let the operator choose how to combine the two.
  go(command, name) {
    if (!this.value?.round_active) return this.send(command);
    this.pendingGoal = command;
    text("when-title", tr("A delivery round is active. Drive to {place}:", { place: name }));
    $("when").hidden = false;
    $("when_now").focus();
    return true;
  }

  answer(when) {
    const command = this.pendingGoal;
    this.pendingGoal = null;
    $("when").hidden = true;
    if (command && when) this.send({ ...command, when });
  }
}

function arrival({ place, distance, time: left, reachable }) {
  if (!reachable) return tr("{place}: no path on the map.", { place: title(place) });
  return tr("{place}: {metres}, about {time}.", { place: title(place), metres: metres(distance), time: time(left) });
}

// Distance, time and, where it is known, charge of the battery at the end of a round.
function homeAgain(home) {
  const values = { metres: metres(home.distance), time: time(home.time), battery: charge(home)[0] };
  return home.battery === null ? tr("Back home: {metres}, about {time}.", values)
    : tr("Back home: {metres}, about {time}, {battery} battery.", values);
}

const metres = (length) => tr("{number} m", { number: Math.round(length) });
const charge = ({ battery }) => (battery === null ? [] : [`${battery} %`]);
const time = (seconds) => (seconds < 90 ? tr("{number} s", { number: Math.max(10, seconds) }) : tr("{number} min", { number: Math.round(seconds / 60) }));
const moved = (list, i) => [...list.slice(0, i - 1), list[i], list[i - 1], ...list.slice(i + 1)];

function chip(sign, label, action) {
  const button = document.createElement("button");
  button.textContent = sign;
  button.ariaLabel = button.title = label;
  button.onclick = () => action(button);
  return button;
}

// What takes food away from somebody needs a second tap on the question that the first one shows.
function confirmed(question, action, ended = () => {}) {
  let shown = null;
  return (button) => {
    if (shown !== null) {
      if (performance.now() - shown <= DOUBLE_TAP) return;
      shown = Infinity;                  // a third tap does nothing
      action();
      return;
    }
    const { textContent: sign, ariaLabel: label } = button;
    const show = (content, accessible) => {
      [button.textContent, button.ariaLabel] = [content, accessible];
      button.classList.toggle("question", shown !== null);
    };
    shown = performance.now();
    show(question, `${label ?? sign}. ${question}`);
    setTimeout(() => { shown = null; show(sign, label); ended(); }, DOUBT);
  };
}
