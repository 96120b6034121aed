// Rooms of a map: regions of its floor that passages divide (morphological segmentation: Bormann et al., "Room
// Segmentation: Survey, Implementation, and Analysis", ICRA 2016, section III A).

const CELL = 0.1;                        // metres; the map is reduced to cells of about this size
const MOST_CELLS = 250000;               // of the reduced map
const CLEARANCES = [0.9, 0.75, 0.6, 0.45]; // metres; what is connected at such a distance from walls is one room
const FURNITURE = 1.5;                   // metres; what is smaller and stands free is no wall
const WIDEST_DOOR = 1.6;                 // metres; parts with a longer common border are one room
const NARROW = 0.75;                     // length of a border between rooms, as a share of the width of the narrower one
const SMALLEST = 3;                      // square metres of a room
const TINTS = 6;                         // neighbouring rooms have different ones

// Return null for a map of fewer than two rooms, else the reduced grid whose cells hold the tint of their room, 1 to TINTS,
// and 0 elsewhere. `isFree` and `isWall` classify the values of the map's cells.
export function findRooms(grid, isFree, isWall) {
  const reduced = withoutFurniture(reduce(grid, isFree, isWall)), { width, resolution } = reduced;
  const far = distances(reduced), seeds = findSeeds(reduced, far);
  const parts = grow(reduced, seeds.labels, far);
  const borders = commonBorders(parts, width, seeds.count);
  const room = mergedParts(parts, far, borders, seeds.count, resolution);
  const labels = parts.map((part) => room[part]), all = new Set(labels);
  all.delete(0);
  if (all.size < 2) return null;
  const tint = tints(borders, room, all);
  return { ...reduced, cells: Uint8Array.from(widened(labels, width), (label) => tint.get(label) ?? 0), count: all.size };
}

// Where the robot has a place far from walls begins a room; then those without so much space, in which none has begun.
function findSeeds(reduced, far) {
  const labels = new Int32Array(reduced.open.length);
  let count = 0;
  for (const clearance of CLEARANCES) {
    const least = 3 * clearance / reduced.resolution;
    const regions = components(reduced, far.map((distance) => (distance >= least ? 1 : 0)));
    const begun = new Set();
    labels.forEach((label, i) => { if (label) begun.add(regions.labels[i]); });
    const added = new Map();
    regions.labels.forEach((region, i) => {
      if (!region || begun.has(region)) return;
      if (!added.has(region)) added.set(region, ++count);
      labels[i] = added.get(region);
    });
  }
  return { labels, count };
}

// Closed regions that are small and stand free, such as chairs, tables and their legs, count as floor.
function withoutFurniture(reduced) {
  const { width, height, resolution } = reduced, closed = reduced.open.map((open) => 1 - open);
  const { labels, count } = components(reduced, closed);
  const boxes = Array.from({ length: count + 1 }, () => [width, -1, height, -1]);
  labels.forEach((label, i) => {
    const box = boxes[label], column = i % width, row = Math.floor(i / width);
    boxes[label] = [Math.min(box[0], column), Math.max(box[1], column), Math.min(box[2], row), Math.max(box[3], row)];
  });
  const limit = FURNITURE / resolution;
  const small = boxes.map(([left, right, bottom, top], label) => label && right - left < limit && top - bottom < limit);
  const free = (mask) => mask.map((value, i) => (small[labels[i]] ? 1 : value));
  return { ...reduced, open: free(reduced.open), floor: free(reduced.floor) };
}

// A cell is floor if any of its cells is free, and open if none of them is a wall or unknown.
function reduce(grid, isFree, isWall) {
  const smallest = Math.sqrt(grid.width * grid.height / MOST_CELLS);
  const factor = Math.max(1, Math.round(CELL / grid.resolution), Math.ceil(smallest));
  const width = Math.ceil(grid.width / factor), height = Math.ceil(grid.height / factor);
  const floor = new Uint8Array(width * height), open = new Uint8Array(width * height).fill(1);
  for (let row = 0; row < grid.height; row++) {
    const to = Math.floor(row / factor) * width, from = row * grid.width;
    for (let column = 0; column < grid.width; column++) {
      const cell = to + Math.floor(column / factor), value = grid.cells[from + column];
      if (isFree(value)) floor[cell] = 1;
      else if (isWall(value) || value < 0) open[cell] = 0;
    }
  }
  for (let i = 0; i < open.length; i++) open[i] &= floor[i];
  return { x: grid.x, y: grid.y, yaw: grid.yaw, resolution: grid.resolution * factor, width, height, floor, open };
}

// Distance of each cell from those that are not open, in thirds of a cell: chamfer distances in two passes (Borgefors
// 1986: 3 for a neighbour at an edge, 4 for one at a corner). Outside of the map nothing is open.
function distances({ width, height, open }) {
  const stride = width + 2, far = new Uint16Array(stride * (height + 2));
  for (let row = 0; row < height; row++) {
    for (let column = 0; column < width; column++) far[(row + 1) * stride + column + 1] = open[row * width + column] ? 65000 : 0;
  }
  const pass = (begin, end, step) => {
    for (let i = begin; i !== end; i += step) {
      if (!far[i]) continue;
      far[i] = Math.min(far[i], far[i - step] + 3, far[i - step * stride] + 3, far[i - step * (stride + 1)] + 4, far[i - step * (stride - 1)] + 4);
    }
  };
  pass(stride + 1, far.length - stride - 1, 1);
  pass(far.length - stride - 2, stride, -1);
  return Uint16Array.from(open, (_, i) => far[(Math.floor(i / width) + 1) * stride + i % width + 1]);
}

// Label connected cells with 1, 2, ..., others with 0.
function components({ width, height }, member) {
  const labels = new Int32Array(member.length);
  let count = 0;
  for (let start = 0; start < member.length; start++) {
    if (!member[start] || labels[start]) continue;
    labels[start] = ++count;
    spread([start], width, height, (from, to) => {
      if (!member[to] || labels[to]) return false;
      labels[to] = labels[from];
      return true;
    });
  }
  return { labels, count };
}

// Extend labels over the floor, the cells farthest from walls first, so that two of them meet where it is narrowest: a
// watershed (Meyer 1994) of the distances, with a queue for each distance.
function grow({ width, height, floor }, seeds, far) {
  const labels = seeds.slice(), queues = Array.from({ length: far.reduce((a, b) => Math.max(a, b), 0) + 1 }, () => []);
  labels.forEach((label, i) => { if (label) queues[far[i]].push(i); });
  for (let level = queues.length - 1; level >= 0; level--) {
    const cells = queues[level];
    spread(cells, width, height, (from, to) => {
      if (!floor[to] || labels[to]) return false;
      labels[to] = labels[from];
      if (far[to] >= level) return true;
      queues[far[to]].push(to);
      return false;
    });
  }
  return labels;
}

// Visit cells in breadth, from each to its neighbours at an edge that `enter(from, to)` accepts.
function spread(cells, width, height, enter) {
  for (let k = 0; k < cells.length; k++) {
    const cell = cells[k], column = cell % width, row = Math.floor(cell / width);
    if (column > 0 && enter(cell, cell - 1)) cells.push(cell - 1);
    if (column < width - 1 && enter(cell, cell + 1)) cells.push(cell + 1);
    if (row > 0 && enter(cell, cell - width)) cells.push(cell - width);
    if (row < height - 1 && enter(cell, cell + width)) cells.push(cell + width);
  }
}

// The common border of two parts, in edges of cells, by `low * (count + 1) + high`.
function commonBorders(labels, width, count) {
  const borders = new Map();
  const note = (a, b) => {
    if (!a || !b || a === b) return;
    const key = Math.min(a, b) * (count + 1) + Math.max(a, b);
    borders.set(key, (borders.get(key) ?? 0) + 1);
  };
  for (let i = 0; i < labels.length; i++) {
    if ((i + 1) % width) note(labels[i], labels[i + 1]);
    if (i + width < labels.length) note(labels[i], labels[i + width]);
  }
  return { edges: borders, base: count + 1 };
}

// The room of each part. Parts are one where their border is longer than a door is wide, or hardly shorter than one of them
// is wide; a small part belongs to the one with which it has the longest border.
function mergedParts(parts, far, { edges, base }, count, resolution) {
  const room = Array.from({ length: count + 1 }, (_, i) => i), areas = new Array(count + 1).fill(0), widths = areas.slice();
  parts.forEach((part, i) => {
    areas[part] += resolution ** 2;
    widths[part] = Math.max(widths[part], 2 / 3 * far[i] * resolution);
  });
  const root = (i) => { while (room[i] !== i) i = room[i]; return i; };
  for (const [key, edge] of [...edges].sort((a, b) => b[1] - a[1])) {
    const a = root(Math.floor(key / base)), b = root(key % base), length = edge * resolution;
    const narrow = length <= Math.min(WIDEST_DOOR, NARROW * Math.min(widths[a], widths[b]));
    if (a === b || (narrow && Math.min(areas[a], areas[b]) >= SMALLEST)) continue;
    room[a] = b;
    areas[b] += areas[a];
    widths[b] = Math.max(widths[a], widths[b]);
  }
  return room.map((_, i) => root(i));
}

// A tint for each room, another one than those of its neighbours as far as there are enough: first for a corridor, which has
// the highest number of them (Welsh and Powell 1967).
function tints({ edges, base }, room, all) {
  const neighbours = new Map([...all].map((label) => [label, new Set()]));
  for (const key of edges.keys()) {
    const [a, b] = [room[Math.floor(key / base)], room[key % base]];
    if (a === b) continue;
    neighbours.get(a).add(b);
    neighbours.get(b).add(a);
  }
  const tint = new Map();
  [...all].sort((a, b) => neighbours.get(b).size - neighbours.get(a).size || a - b).forEach((label, i) => {
    const taken = new Set([...neighbours.get(label)].map((other) => tint.get(other)));
    const order = Array.from({ length: TINTS }, (_, k) => (i + k) % TINTS + 1);
    tint.set(label, order.find((one) => !taken.has(one)) ?? order[0]);
  });
  return tint;
}

// Also one cell beyond the floor, so that the tint reaches the wall.
function widened(labels, width) {
  return labels.map((label, i) => label || [i - 1, i + 1, i - width, i + width].map((k) => labels[k]).find(Boolean) || 0);
}
