// The log of all nodes, the newest message first, by level and text.
import { tr, translated } from "./language.js";

const $ = (id) => document.getElementById(id);
const LEVELS = [[10, "DEBUG"], [20, "INFO"], [30, "WARN"], [40, "ERROR"], [50, "FATAL"]];   // rcl_interfaces/msg/Log

export class LogConsole {
  constructor() {
    this.lines = [];
    $("log-level").replaceChildren(...LEVELS.map(([level, name]) => new Option(name, level, level === 20, level === 20)));
    $("log-level").onchange = $("log-filter").oninput = () => this.list();
  }

  show(lines) {
    this.lines = lines;
    this.list();
  }

  list() {
    const least = Number($("log-level").value), wanted = $("log-filter").value.trim().toLowerCase();
    const found = this.lines.map((line) => ({ ...line, text: translated(line.text) }))
      .filter(({ level, node, text }) => level >= least && `${node} ${text}`.toLowerCase().includes(wanted));
    $("log-note").textContent = found.length ? "" : tr("No messages yet.");
    $("log-list").replaceChildren(...found.reverse().map(({ time, level, node, text }) => {
      const item = document.createElement("li"), head = document.createElement("small");
      item.dataset.level = levelName(level);
      head.textContent = `${time.toFixed(1)} ${levelName(level)} ${node}`;
      item.append(head, ` ${text}`);
      return item;
    }));
  }
}

const levelName = (level) => (LEVELS.findLast(([from]) => level >= from) ?? LEVELS[0])[1];
