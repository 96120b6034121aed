// Where the nodes of a graph stand in its picture: columns along the flow of data, after Sugiyama, Tagawa and Toda 1981.

const SWEEPS = 6;                        // over the columns, to cross fewer lines

// `edges` is a map from node to the nodes that receive from it. Returns columns of nodes; data flows from left to right,
// except where it flows in a circle.
export function nodeColumns(nodes, edges) {
  const forward = withoutCycles(nodes, edges), column = longestPaths(nodes, forward);
  const columns = [];
  for (const node of nodes) (columns[column.get(node)] ??= []).push(node);
  const neighbours = bothWays(nodes, edges);
  for (let sweep = 0; sweep < SWEEPS; sweep++) {
    const order = sweep % 2 ? [...columns.keys()].reverse() : [...columns.keys()];
    for (const i of order) columns[i] = byNeighbours(columns[i], columns, neighbours);
  }
  return columns;
}

// The edges without those that close a circle in a depth-first walk.
function withoutCycles(nodes, edges) {
  const state = new Map(), forward = new Map(nodes.map((node) => [node, []]));
  const walk = (node) => {
    state.set(node, "open");
    for (const next of edges.get(node) ?? []) {
      if (state.get(next) === "open") continue;
      forward.get(node).push(next);
      if (!state.has(next)) walk(next);
    }
    state.set(node, "done");
  };
  for (const node of nodes) if (!state.has(node)) walk(node);
  return forward;
}

// The number of edges on the longest path to each node.
function longestPaths(nodes, forward) {
  const before = new Map(nodes.map((node) => [node, []])), length = new Map();
  for (const [node, targets] of forward) for (const target of targets) before.get(target).push(node);
  const measure = (node) => {
    if (!length.has(node)) length.set(node, Math.max(0, ...before.get(node).map((source) => measure(source) + 1)));
    return length.get(node);
  };
  nodes.forEach(measure);
  return length;
}

function bothWays(nodes, edges) {
  const neighbours = new Map(nodes.map((node) => [node, new Set()]));
  for (const [node, targets] of edges) {
    for (const target of targets) {
      neighbours.get(node).add(target);
      neighbours.get(target).add(node);
    }
  }
  return neighbours;
}

// Sort a column by the mean place of each node's neighbours, from 0 at the top of their columns to 1.
function byNeighbours(nodes, columns, neighbours) {
  const place = new Map(columns.flatMap((column) => column.map((node, i) => [node, (i + 0.5) / column.length])));
  const mean = (node) => {
    const around = [...neighbours.get(node)].map((other) => place.get(other));
    return around.length ? around.reduce((sum, one) => sum + one, 0) / around.length : place.get(node);
  };
  const means = new Map(nodes.map((node) => [node, mean(node)]));
  return [...nodes].sort((a, b) => means.get(a) - means.get(b));
}
