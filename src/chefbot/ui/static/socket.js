// The one connection to the robot: decodes what arrives, notices within a second when it is dead, connects again.
import { decode } from "./wire.js";

const FIRST_RETRY = 100, LAST_RETRY = 2000;
const PING = 250, SILENCE = 700, OPENING = 3000;         // milliseconds
const TRIPS = 20, SLOW = 3;              // a link whose answers took long lately is given so many times that long
const UNHEARD = new Set(["drive", "ping", "stop", "withdraw"]);   // no need to say that one of these was lost

export class Link extends EventTarget {
  constructor(url) {
    super();
    this.url = url;
    this.retry = FIRST_RETRY;
    this.pings = 0;
    this.sent = new Map();               // when each ping without an answer yet left
    this.trips = [];                     // how long answers took lately, milliseconds
    this.unsure = [];                    // commands that left, and no answer to a later ping has come
    this.watched = performance.now();
    this.connect();
    setInterval(() => this.watch(), PING);
  }

  get open() { return this.socket.readyState === WebSocket.OPEN; }

  connect() {
    const socket = new WebSocket(this.url);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    this.order = Promise.resolve();
    this.sent.clear();
    this.heard = performance.now();
    socket.onopen = () => { this.heard = performance.now(); this.retry = FIRST_RETRY; this.tell("up"); };
    socket.onmessage = (event) => { this.heard = performance.now(); this.receive(event.data); };
    socket.onclose = () => this.reconnect();
  }

  // A half-open connection takes bytes for minutes: only what comes back shows that it is alive.
  watch() {
    const now = performance.now(), asleep = now - this.watched > 2 * PING;
    this.watched = now;
    if (asleep) this.heard = now;        // the page stood still, perhaps not the connection
    if (this.socket.readyState <= WebSocket.OPEN && now - this.heard > this.patience()) this.abandon();
    else if (this.open) {
      this.sent.set(++this.pings, now);
      this.send({ do: "ping", n: this.pings });
    }
  }

  patience() {
    if (!this.open || !this.trips.length) return OPENING;
    return Math.max(SILENCE, SLOW * Math.max(...this.trips));
  }

  answered(ping) {
    const now = performance.now();
    if (this.sent.has(ping)) this.trips = [now - this.sent.get(ping), ...this.trips].slice(0, TRIPS);
    for (const number of this.sent.keys()) if (number <= ping) this.sent.delete(number);
    this.unsure = this.unsure.filter(([after]) => after >= ping);
  }

  abandon() {
    const dead = this.socket;
    dead.onopen = dead.onmessage = dead.onclose = null;
    dead.close();
    this.reconnect();
  }

  reconnect() {
    const lost = this.unsure.map(([, command]) => command);
    this.unsure = [];
    this.tell("down", lost);
    setTimeout(() => this.connect(), this.retry);
    this.retry = Math.min(2 * this.retry, LAST_RETRY);
  }

  // Unpacking a map takes a moment; the chain keeps messages in the order in which they came. STOP does not wait.
  receive(data) {
    const text = typeof data === "string";
    if (text && data.startsWith('{"pong"')) {
      this.answered(JSON.parse(data).pong);
      return;
    }
    const at = this.socket;
    const take = (message) => {
      if (at !== this.socket) return;
      if (message.refused) this.tell("refused", message.refused);
      else this.tell("layer", message);
    };
    if (text && data.startsWith('{"layer":"stop"')) { take(JSON.parse(data)); return; }
    const decoded = decode(data);
    this.order = this.order.then(async () => take(await decoded))
      .catch((error) => this.tell("refused", `The page could not read a message of the robot: ${error.message}`));
  }

  tell(kind, detail) { this.dispatchEvent(new CustomEvent(kind, { detail })); }

  // True when the command left at once. A drive command that would have to wait is dropped: late is wrong.
  send(command) {
    if (!this.open) return false;
    if (command.do === "drive" && (command.v || command.w) && this.socket.bufferedAmount > 0) return false;
    this.socket.send(JSON.stringify(command));
    if (!UNHEARD.has(command.do)) this.unsure.push([this.pings, command]);
    return true;
  }
}
