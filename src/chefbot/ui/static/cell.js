// A cell of the global costmap as a sentence: where, what it costs, and what marked it.
import { title, tr } from "./language.js";

const COSTS = new Map([[0, tr("free")], [253, tr("too near to an obstacle")], [254, tr("an obstacle")], [255, tr("unknown")]]);

export function cellSentence({ x, y, cost, marks }) {
  const at = { x: x.toFixed(2), y: y.toFixed(2) };
  if (cost === null) return tr("The point {x}, {y} is outside the costmap.", at);
  const costs = COSTS.has(cost) ? `${cost} (${COSTS.get(cost)})` : String(cost);
  const whole = tr("Cell {x}, {y}: cost {costs}", { ...at, costs });
  const by = marks.map(([source, age]) => (age === null ? title(source) : tr("{source}, {seconds} s ago", { source: title(source), seconds: age.toFixed(1) })));
  return by.length ? `${whole}. ${tr("Marked by: {sources}", { sources: by.join("; ") })}` : whole;
}
