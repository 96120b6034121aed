// The delivery round: buttons for what the robot waits for, and the choice between the round and another goal.
import { title } from "./layers.js";

const $ = (id) => document.getElementById(id);
const text = (id, value) => { if ($(id).textContent !== value) $(id).textContent = value; };
const names = (list) => (list ?? []).map(title).join(", ");

export class RoundCard {
  constructor(send) {
    this.send = send;
    this.value = null;
    this.queue = "[]";
    this.forecast = [];                  // stops that are left, with metres, seconds and battery
    for (const press of ["loaded", "taken", "not_taken"]) {
      $(press).onclick = () => send({ do: press, place: this.value?.place ?? "" });
    }
    for (const choice of ["go_on", "kitchen", "end"]) $(choice).onclick = () => send({ do: "choose", choice });
    $("again").onclick = () => send({ do: "deliver", tables: this.value.unserved });
    $("shortest").onclick = () => send({ do: "shortest_order", order: this.value.order_id });
    for (const when of ["now", "after", "instead"]) $(`when_${when}`).onclick = () => this.answer(when);
    $("when_not").onclick = () => this.answer("");
  }

  show(value) {
    this.value = value;
    const waits = value?.waits_for ?? "", next = value?.place ? title(value.place) : "the next order";
    text("step", value?.step || "No delivery.");
    text("round-rest", this.rest(value));
    $("loaded").hidden = waits !== "loaded";
    $("taken").hidden = $("not_taken").hidden = waits !== "taken";
    for (const choice of ["go_on", "kitchen", "end"]) $(choice).hidden = !value?.choices.includes(choice);
    text("go_on", value?.place ? `Go on to ${next}` : `Begin with ${next}`);
    text("end", value?.round_active ? "End the round" : "Cancel the next order");
    $("again").hidden = !value?.unserved.length;
    text("again", `Order ${names(value?.unserved)} again`);
    this.showQueue(value?.queue ?? []);
    $("shortest").hidden = (value?.queue ?? []).length < 2;
    this.showForecast(this.forecast);
    document.body.classList.toggle("waits", Boolean(waits));
    if (!value?.round_active) this.answer("");
  }

  // The tables that are left, each with buttons to serve it earlier and to leave it out.
  showQueue(queue) {
    const state = JSON.stringify(queue);
    if (state === this.queue) return;      // keeps the focus on a button
    this.queue = state;
    $("queue").replaceChildren(...queue.map((name, i) => {
      const item = document.createElement("li"), label = document.createElement("span");
      label.textContent = title(name);
      const when = document.createElement("small");
      when.title = "Way, time and battery on arrival";
      const earlier = chip("↑", `Serve ${title(name)} earlier`, () => this.changeQueue(moved(queue, i)));
      const leave = chip("×", `Leave out ${title(name)}`, () => this.changeQueue(queue.filter((_, k) => k !== i)));
      earlier.disabled = i === 0;
      item.append(label, when, earlier, leave);
      return item;
    }));
  }

  // Under the step: the way to the next stop, and when the robot is home. On each chip: when that table is reached.
  showForecast(forecast) {
    this.forecast = forecast;
    const { queue = [], state = "", place = "", round_active: active = false } = this.value ?? {};
    const stops = active ? forecast : [], [next] = stops, home = stops.at(-1);
    const drives = next?.place === place && (state === "driving" || state === "returning");
    text("eta", [
      drives && `${title(place)}: ${metres(next.distance)}, about ${time(next.time)}.`,
      home && stops.length > 1 && `Home again: ${[metres(home.distance), `about ${time(home.time)}`, ...charge(home)].join(", ")}${home.battery === null ? "" : " battery"}.`,
    ].filter(Boolean).join(" "));
    let from = drives ? 1 : 0;
    for (const [i, name] of queue.entries()) {
      const found = stops.findIndex((stop, k) => k >= from && stop.place === name);
      const chip = $("queue").children[i].querySelector("small"), stop = stops[found];
      if (stop) from = found + 1;
      chip.textContent = stop ? [metres(stop.distance), time(stop.time), ...charge(stop)].join(" · ") : "";
    }
  }

  changeQueue(tables) { this.send({ do: "queue", tables, order: this.value.order_id }); }

  // The newest rounds first, each with what became of its tables.
  showHistory(rounds) {
    $("history-box").hidden = !rounds.length;
    $("history").replaceChildren(...rounds.map((round) => {
      const item = document.createElement("li"), head = document.createElement("b");
      const began = new Date(round.began).toLocaleString([], { dateStyle: "short", timeStyle: "short" });
      head.textContent = round.ordered_by ? `${began}, ${round.ordered_by}: ` : `${began}: `;
      item.append(head, round.stops.map((stop) => `${title(stop.place)} ${stop.outcome || "open"}`).join("; "));
      return item;
    }));
  }

  // Names of the tables that are still to be served; empty without a round.
  unserved() {
    const { state = "", place = "", loaded = false, queue = [], orders = [] } = this.value ?? {};
    const next = loaded && (state === "driving" || state === "waiting") ? [place] : [];
    return names([...next, ...queue, ...orders.flat()]);
  }

  rest(value) {
    const orders = (value?.orders ?? []).map(names).join("; ");
    return [
      value?.delivered.length && `Taken at: ${names(value.delivered)}.`,
      value?.errands.length && `Then to: ${names(value.errands.map((name) => name || "a point on the map"))}.`,
      orders && `Ordered after that: ${orders}.`,
      ...(value?.missed ?? []).map((why) => `Not served: ${why}.`),
    ].filter(Boolean).join(" ");
  }

  // Send a goal; during a round, first let the operator choose how to combine the two.
  go(command, name) {
    if (!this.value?.round_active) return this.send(command);
    this.pendingGoal = command;
    text("when-title", `A delivery round is active. Drive to ${name}:`);
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

const metres = (length) => `${Math.round(length)} m`;
const charge = ({ battery }) => (battery === null ? [] : [`${battery} %`]);
const time = (seconds) => (seconds < 90 ? `${Math.max(10, seconds)} s` : `${Math.round(seconds / 60)} min`);
const moved = (list, i) => [...list.slice(0, i - 1), list[i], list[i - 1], ...list.slice(i + 1)];

function chip(sign, label, action) {
  const button = document.createElement("button");
  button.textContent = sign;
  button.ariaLabel = button.title = label;
  button.onclick = action;
  return button;
}
