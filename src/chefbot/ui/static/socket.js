// The one connection to the robot: decodes what arrives, reconnects by itself, never stores commands for later.
import { decode } from "./wire.js";

const FIRST_RETRY = 500, LAST_RETRY = 4000;

export class Link extends EventTarget {
  constructor(url) {
    super();
    this.url = url;
    this.retry = FIRST_RETRY;
    this.connect();
  }

  get open() { return this.socket.readyState === WebSocket.OPEN; }

  connect() {
    this.socket = new WebSocket(this.url);
    this.socket.binaryType = "arraybuffer";
    this.order = Promise.resolve();
    this.socket.onopen = () => { this.retry = FIRST_RETRY; this.tell("up"); };
    this.socket.onmessage = (event) => this.receive(event.data);
    this.socket.onclose = () => this.reconnect();
  }

  reconnect() {
    this.tell("down");
    setTimeout(() => this.connect(), this.retry);
    this.retry = Math.min(2 * this.retry, LAST_RETRY);
  }

  // Unpacking a map takes a moment; the chain keeps messages in the order in which they came.
  receive(data) {
    const decoded = decode(data);
    this.order = this.order.then(async () => {
      const message = await decoded;
      if (message.refused) this.tell("refused", message.refused);
      else this.tell("layer", message);
    }).catch((error) => this.tell("refused", `The page could not read a message of the robot: ${error.message}`));
  }

  tell(kind, detail) { this.dispatchEvent(new CustomEvent(kind, { detail })); }

  // True when the command left at once. A drive command that would have to wait is dropped: late is wrong.
  send(command) {
    if (!this.open) return false;
    if (command.do === "drive" && (command.v || command.w) && this.socket.bufferedAmount > 0) return false;
    this.socket.send(JSON.stringify(command));
    return true;
  }
}
