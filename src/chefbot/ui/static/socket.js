// The connection to the robot: decodes messages, detects a dead connection within a second, and reconnects.
import { tr } from "./language.js";
import { decode } from "./wire.js";

const FIRST_RETRY = 100, LAST_RETRY = 2000;
const PING = 250, SILENCE = 700, OPENING = 3000, HURRIED = 2000;         // milliseconds
const TRIPS = 20, SLOW = 3;              // timeout as a multiple of the longest recent round trip
const UNREPORTED = new Set(["drive", "ping", "stop", "withdraw", "show", "received", "inspect"]);   // the loss of these is not reported

export class Link extends EventTarget {
  // `layers()` lists what the web UI shows; nothing else is sent.
  constructor(url, layers) {
    super();
    this.url = url;
    this.layers = layers;
    this.retry = FIRST_RETRY;
    this.opened = false;                 // whether the connection that is made or was lost has ever been open
    this.pings = 0;
    this.sent = new Map();               // send times of the pings without a response
    this.trips = [];                     // recent round-trip times, milliseconds
    this.unsure = [];                    // commands that are not acknowledged, each with the ping after it
    this.doubtful = [];                  // such commands of connections that were lost
    this.page = crypto.getRandomValues(new Uint32Array(4)).join("-");
    this.pause = null;                   // timer of the pause before the next attempt
    this.hurriedAt = -Infinity;          // when a press of the emergency stop waited for a connection
    this.server = "";                    // name of the robot's server, another one after a restart
    this.watched = performance.now();
    this.connect();
    setInterval(() => this.watch(), PING);
  }

  get open() { return this.socket.readyState === WebSocket.OPEN; }

  connect() {
    const socket = new WebSocket(`${this.url}?page=${this.page}&layers=${this.layers().join(",")}`);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    this.order = Promise.resolve();
    this.opened = false;
    this.sent.clear();
    this.received = 0;                   // pieces of bulk layers
    this.pieces = [];                    // of the bulk layer that is arriving
    this.receivedAt = performance.now();
    socket.onopen = () => { this.opened = true; this.receivedAt = performance.now(); this.retry = FIRST_RETRY; this.emit("up"); };
    socket.onmessage = (event) => {
      this.receivedAt = performance.now();
      const whole = typeof event.data === "string" ? event.data : this.assemble(event.data);
      if (whole !== null) this.receive(whole);
    };
    socket.onclose = () => this.reconnect();
  }

  // A half-open connection accepts bytes for minutes: only received data prove that it is alive.
  watch() {
    const now = performance.now(), suspended = now - this.watched > 2 * PING;
    this.watched = now;
    if (suspended) this.receivedAt = now;        // the page was suspended, perhaps not the connection
    if (this.socket.readyState <= WebSocket.OPEN && now - this.receivedAt > this.timeout()) this.abandon();
    else if (this.open) this.ping();
    this.emit("age", this.age(now));
  }

  ping() {
    this.sent.set(++this.pings, performance.now());
    this.send({ do: "ping", n: this.pings });
  }

  // Pings queue behind the layers: how long the latest one has taken is how old the view is, milliseconds.
  age(now) {
    const [waiting] = this.sent.values();
    return Math.max(this.trips[0] ?? 0, waiting === undefined ? 0 : now - waiting);
  }

  show() { this.send({ do: "show", layers: this.layers() }); }

  // Return the bulk layer whose last piece this is, else null. The robot has little under way until more is acknowledged,
  // so that nothing old queues up on a slow link.
  assemble(piece) {
    this.send({ do: "received", n: ++this.received });
    const bytes = new Uint8Array(piece), parts = this.pieces;
    parts.push(bytes.subarray(1));
    if (bytes[0] === 1) return null;
    this.pieces = [];
    const whole = new Uint8Array(parts.reduce((size, part) => size + part.length, 0));
    let at = 0;
    for (const part of parts) { whole.set(part, at); at += part.length; }
    return whole.buffer;
  }

  timeout() {
    if (!this.open && performance.now() - this.hurriedAt < HURRIED) return HURRIED;
    if (!this.open || !this.trips.length) return OPENING;
    return Math.max(SILENCE, SLOW * Math.max(...this.trips));
  }

  answered(ping) {
    const now = performance.now();
    if (this.sent.has(ping)) this.trips = [now - this.sent.get(ping), ...this.trips].slice(0, TRIPS);
    for (const number of this.sent.keys()) if (number <= ping) this.sent.delete(number);
    const done = this.unsure.filter(([after]) => after <= ping), at = this.socket;
    this.unsure = this.unsure.filter(([after]) => after > ping);
    // In the order of arrival: a refusal that came before may wait for a map that is being decoded.
    this.order = this.order.then(() => {
      if (at === this.socket) for (const [, command] of done) this.emit("done", command);
    });
  }

  abandon() {
    const dead = this.socket;
    dead.onopen = dead.onmessage = dead.onclose = null;
    // A browser reports it as an error if a connection is closed before it is open.
    if (dead.readyState === WebSocket.CONNECTING) dead.onopen = () => dead.close();
    else dead.close();
    this.reconnect();
  }

  // A robot that answers but refuses this link gives a reason, which a web socket does not show. Without an answer, the
  // connection is simply lost.
  async askWhy() {
    const answer = await fetch("/", { cache: "no-store" }).catch(() => null);
    if (answer?.status === 403) this.emit("locked", await answer.text());
  }

  reconnect() {
    const lost = this.unsure.map(([, command]) => command);
    this.doubtful.push(...this.unsure);
    this.unsure = [];
    this.emit("down", lost);
    if (!this.opened) this.askWhy();
    this.pause = setTimeout(() => this.endPause(), this.retry);
    this.retry = Math.min(2 * this.retry, LAST_RETRY);
  }

  endPause() {
    clearTimeout(this.pause);
    this.pause = null;
    this.connect();
  }

  // A press of the emergency stop does not wait for the end of a pause.
  hurry() {
    this.hurriedAt = performance.now();
    if (this.pause !== null) this.endPause();
  }

  // What was sent before the last ping that the robot received has arrived, although its answer was lost.
  greeted({ connected, last_ping, role, has_map }) {
    const arrived = this.doubtful.length > 0 && this.doubtful.every(([after]) => after <= last_ping);
    const restarted = this.server !== "" && this.server !== connected;
    this.doubtful = [];
    this.server = connected;
    this.emit("greeted", { arrived, restarted, role, hasMap: has_map });
  }

  // Decoding a map takes time; the chain keeps the order of arrival. The emergency stop does not wait.
  receive(data) {
    const text = typeof data === "string";
    if (text && data.startsWith('{"pong"')) {
      this.answered(JSON.parse(data).pong);
      return;
    }
    if (text && data.startsWith('{"connected"')) {
      this.greeted(JSON.parse(data));
      return;
    }
    const at = this.socket;
    const take = (message) => {
      if (at !== this.socket) return;
      if (message.refused) this.emit("refused", message.refused);
      else this.emit("layer", message);
    };
    if (text && data.startsWith('{"layer":"stop"')) { take(JSON.parse(data)); return; }
    const decoded = decode(data);
    this.order = this.order.then(async () => take(await decoded))
      .catch((error) => this.emit("refused", tr("The web UI could not read a message from the robot: {error}", { error: error.message })));
  }

  emit(kind, detail) { this.dispatchEvent(new CustomEvent(kind, { detail })); }

  // Return whether the command was sent. A drive command that would be delayed is dropped.
  send(command) {
    if (!this.open) {
      if (command.do === "stop") this.hurry();
      return false;
    }
    if (command.do === "drive" && (command.v || command.w) && this.socket.bufferedAmount > 0) return false;
    this.socket.send(JSON.stringify(command));
    if (!UNREPORTED.has(command.do)) {
      this.unsure.push([this.pings + 1, command]);
      this.ping();
    }
    return true;
  }
}
