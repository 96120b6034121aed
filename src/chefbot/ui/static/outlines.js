// Outlines of regions of a grid: closed polygons along the edges of its cells, straightened.

const TOLERANCE = 0.6;                   // cells; the steps of a slanted wall deviate by 0.5
const WIDEST_BUMP = 4;                   // cells
const FEW = 8;                           // corners of a polygon that is left as it is: small, or already straight
const STEPS = [[1, 0], [0, 1], [-1, 0], [0, -1]]; // directions 0 to 3: east, north, west, south

// The cells for which `inside(value)` is true, in the grid's frame, metres: the polygons of their outline, the same as a
// Path2D that is filled by the even-odd rule, and the number of corners.
export function regionOutline(grid, inside) {
  const path = new Path2D(), { x, y, resolution } = grid;
  const metres = ([column, row]) => [x + column * resolution, y + row * resolution];
  const polygons = regionLoops(grid, inside).map((loop) => straightened(loop).map(metres));
  for (const polygon of polygons) {
    polygon.forEach((point, i) => { if (i) path.lineTo(...point); else path.moveTo(...point); });
    path.closePath();
  }
  return { polygons, path, corners: polygons.reduce((sum, polygon) => sum + polygon.length, 0) };
}

// The boundary of a region as loops of corners [column, row]: the region is on the left of each edge, and cells that
// touch at a corner are connected, as in a slanted wall of one cell.
export function regionLoops(grid, inside) {
  const edges = boundaryEdges(grid, inside), stride = grid.width + 1, loops = [];
  for (let start = 0; start < edges.length; start++) {
    while (edges[start]) loops.push(followLoop(edges, start, stride));
  }
  return loops;
}

// For each corner of a cell the boundary edges that leave it, a bit for each direction.
function boundaryEdges({ width, height, cells }, inside) {
  const stride = width + 1, edges = new Uint8Array(stride * (height + 1)), member = new Uint8Array(width * height);
  for (let i = 0; i < member.length; i++) member[i] = inside(cells[i]) ? 1 : 0;
  for (let row = 0; row < height; row++) {
    for (let column = 0; column < width; column++) {
      const cell = row * width + column, corner = row * stride + column;
      if (!member[cell]) continue;
      if (row === 0 || !member[cell - width]) edges[corner] |= 1;
      if (column === width - 1 || !member[cell + 1]) edges[corner + 1] |= 2;
      if (row === height - 1 || !member[cell + width]) edges[corner + stride + 1] |= 4;
      if (column === 0 || !member[cell - 1]) edges[corner + stride] |= 8;
    }
  }
  return edges;
}

// Follow the edges from a corner back to it, remove them, and return the corners at which the direction changes.
function followLoop(edges, start, stride) {
  const loop = [];
  let corner = start, direction = 31 - Math.clz32(edges[start] & -edges[start]), last = -1;
  do {
    edges[corner] &= ~(1 << direction);
    if (direction !== last) loop.push([corner % stride, Math.floor(corner / stride)]);
    corner += STEPS[direction][0] + stride * STEPS[direction][1];
    last = direction;
    // Where two cells touch at a corner, the right turn stays on the outside of both.
    direction = [(last + 3) % 4, last, (last + 1) % 4].find((turn) => edges[corner] & (1 << turn));
  } while (corner !== start && direction !== undefined);
  return loop;
}

export function straightened(loop) {
  return loop.length <= FEW ? loop : simplified(throughSteps(withoutBumps(loop)));
}

// Without bumps and notches of one cell in a straight boundary, which are noise of the sensor.
function withoutBumps(loop) {
  const corners = [...loop];
  for (let i = 0; i + 5 < corners.length; i++) {
    const [before, out, along, back, after] = [0, 1, 2, 3, 4].map((k) => edge(corners, i + k));
    const bump = length(out) === 1 && length(along) <= WIDEST_BUMP && out[0] === -back[0] && out[1] === -back[1];
    if (bump && parallel(before, along) && parallel(along, after)) corners.splice(i + 2, 2);
  }
  return corners;
}

// With the middle of each step of one cell in place of its two corners: the middles lie on the slanted wall.
function throughSteps(corners) {
  const n = corners.length, at = (i) => corners[(i + n) % n];
  const side = (i) => [at(i + 1)[0] - at(i)[0], at(i + 1)[1] - at(i)[1]];
  const isStep = corners.map((_, i) => length(side(i)) === 1 && parallel(side(i - 1), side(i + 1)));
  return corners.flatMap((corner, i) => {
    if (isStep[i]) return [[(corner[0] + at(i + 1)[0]) / 2, (corner[1] + at(i + 1)[1]) / 2]];
    return isStep[(i + n - 1) % n] ? [] : [corner];
  });
}

const edge = (corners, i) => [corners[i + 1][0] - corners[i][0], corners[i + 1][1] - corners[i][1]];
const length = ([column, row]) => Math.abs(column) + Math.abs(row);
const parallel = (a, b) => a[0] * b[0] + a[1] * b[1] > 0;

// Ramer-Douglas-Peucker on a closed polygon, from its first corner and the one farthest from that.
function simplified(loop) {
  let far = 0, longest = 0;
  loop.forEach(([column, row], i) => {
    const distance = Math.hypot(column - loop[0][0], row - loop[0][1]);
    if (distance > longest) [far, longest] = [i, distance];
  });
  const closed = [...loop, loop[0]], kept = new Set([0, far]), parts = [[0, far], [far, loop.length]];
  while (parts.length) {
    const [from, to] = parts.pop(), corner = farthest(closed, from, to);
    if (corner < 0) continue;
    kept.add(corner);
    parts.push([from, corner], [corner, to]);
  }
  return kept.size < 4 ? loop : loop.filter((_, i) => kept.has(i));
}

// The index of the corner that is farthest from the line between two others, -1 if all are within the tolerance.
function farthest(corners, from, to) {
  const [x, y] = corners[from], dx = corners[to][0] - x, dy = corners[to][1] - y, length = Math.hypot(dx, dy);
  let index = -1, largest = TOLERANCE;
  for (let i = from + 1; i < to; i++) {
    const px = corners[i][0] - x, py = corners[i][1] - y;
    const distance = length ? Math.abs(px * dy - py * dx) / length : Math.hypot(px, py);
    if (distance > largest) [index, largest] = [i, distance];
  }
  return index;
}
