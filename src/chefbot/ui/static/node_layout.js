// Where the nodes of a graph stand in its picture: columns along the flow of data, sorted so that few lines cross.

const SWEEPS = 6;                        // over the columns

// `edges` is a map from node to the nodes that receive from it. Returns columns of nodes: those that only send, those
// that receive from them, and so on; nodes of a circle follow the one that sends more than it receives.
export function nodeColumns(nodes, edges) {
  const columns = stepsFromSources(nodes, edges), neighbours = bothWays(nodes, edges);
  for (let sweep = 0; sweep < SWEEPS; sweep++) {
    const order = sweep % 2 ? [...columns.keys()].reverse() : [...columns.keys()];
    for (const i of order) columns[i] = byNeighbours(columns[i], columns, neighbours);
  }
  return columns;
}

// Breadth-first search from the nodes without an input; from the largest sender while some are not reached.
function stepsFromSources(nodes, edges) {
  const inputs = new Map(nodes.map((node) => [node, 0])), outputs = (node) => edges.get(node)?.length ?? 0;
  for (const targets of edges.values()) for (const target of targets) inputs.set(target, inputs.get(target) + 1);
  const senders = [...nodes].sort((a, b) => inputs.get(a) - outputs(a) - inputs.get(b) + outputs(b));
  const step = new Map(), columns = [];
  const sources = nodes.filter((node) => inputs.get(node) === 0);
  search(sources.length ? sources : senders.slice(0, 1), edges, step);
  for (const node of senders) if (!step.has(node)) search([node], edges, step);
  for (const node of nodes) (columns[step.get(node)] ??= []).push(node);
  return columns;
}

function search(sources, edges, step) {
  const queue = [...sources];
  for (const node of queue) step.set(node, 0);
  for (const node of queue) {
    for (const next of edges.get(node) ?? []) {
      if (step.has(next)) continue;
      step.set(next, step.get(node) + 1);
      queue.push(next);
    }
  }
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

// Sort a column by the mean place of each node's neighbours, from 0 at the top of their columns to 1 (the barycenters of
// Sugiyama, Tagawa and Toda 1981).
function byNeighbours(nodes, columns, neighbours) {
  const place = new Map(columns.flatMap((column) => column.map((node, i) => [node, (i + 0.5) / column.length])));
  const mean = (node) => {
    const around = [...neighbours.get(node)].map((other) => place.get(other));
    return around.length ? around.reduce((sum, one) => sum + one, 0) / around.length : place.get(node);
  };
  const means = new Map(nodes.map((node) => [node, mean(node)]));
  return [...nodes].sort((a, b) => means.get(a) - means.get(b));
}
