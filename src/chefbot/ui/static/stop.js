// A press of the emergency stop, repeated until the drive base confirms it; an alarm is shown after a timeout.

const REPEAT = 250, ALARM = 300;          // milliseconds
const TICK = 10;                         // milliseconds, while a press is not confirmed
const UNANSWERED = 180;                  // milliseconds after which the connection may be dead
const REQUEST = 130;                     // milliseconds between the requests that are made then
const IN_FLIGHT = 6;                     // of these, that wait for an answer: as many connections as a browser opens to a host
const STORAGE_KEY = "chefbot-stop";             // a reloaded page continues to send the press

export class StopPress {
  // `send(command)` sends a command; `changed()` is called whenever `state` or `alarmed` may have changed.
  constructor(send, changed, store = sessionStorage) {
    Object.assign(this, { send, changed, store });
    this.view = { stopped: false, requested: false, confirmed: [], pressed: "" };
    this.id = store.getItem(STORAGE_KEY);
    this.since = performance.now();
    this.sent = this.requested = -Infinity;
    this.requests = [];                  // that wait for an answer, the oldest first
    this.ticks = this.id && setInterval(() => this.tick(), TICK);
  }

  // not confirmed (pressed here), requested (pressed elsewhere, not confirmed), stopped, or free
  get state() {
    if (this.id) return "not confirmed";
    return this.view.stopped ? "stopped" : this.view.requested ? "requested" : "free";
  }

  get alarmed() { return Boolean(this.id) && performance.now() - this.since > ALARM; }

  press() {
    if (!this.id) {
      this.id = Array.from(crypto.getRandomValues(new Uint32Array(3)), (part) => part.toString(36)).join("-");
      this.since = performance.now();
      this.store.setItem(STORAGE_KEY, this.id);
      this.ticks = setInterval(() => this.tick(), TICK);
    }
    this.repeat();
    this.changed();
  }

  // Withdraw the press; if the drive base has latched it already, only Release STOP releases it.
  withdraw() {
    this.send({ do: "withdraw", id: this.id });
    this.forget();
  }

  // Receive the state of the drive base. Only the id of this press confirms it: "stopped" may be old.
  take(view) {
    this.view = view ?? this.view;
    if (this.id && this.view.confirmed.includes(this.id)) this.forget();
    this.changed();
  }

  // On every new connection, and every quarter of a second while there is one.
  repeat() {
    this.sent = performance.now();
    if (!this.id) return;
    this.send({ do: "stop", id: this.id });
  }

  // The connection may be dead and a new one not answered for seconds: each request opens its own, so that the first one
  // after the network has come back arrives.
  request() {
    this.requested = performance.now();
    if (this.requests.length >= IN_FLIGHT) this.requests[0].abort();
    const request = new AbortController();
    this.requests.push(request);
    fetch("/stop", { method: "POST", body: JSON.stringify({ do: "stop", id: this.id }), signal: request.signal, cache: "no-store" })
      .catch(() => null)                 // the next one follows; the alarm stays until the drive base confirms
      .finally(() => this.requests.splice(this.requests.indexOf(request), 1));
  }

  tick() {
    const now = performance.now();
    if (now - this.sent >= REPEAT) this.repeat();
    if (now - this.since >= UNANSWERED && now - this.requested >= REQUEST) this.request();
    this.changed();
  }

  forget() {
    clearInterval(this.ticks);
    this.id = null;
    for (const request of this.requests) request.abort();   // one that is under way must not stop the robot later
    this.store.removeItem(STORAGE_KEY);
    this.changed();
  }
}
