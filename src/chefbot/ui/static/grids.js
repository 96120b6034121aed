// Maps as outlines of walls and floor, and costmaps as pictures.
import { COLOURS, isDark } from "./colours.js";
import { regionOutline } from "./outlines.js";
import { findRooms } from "./rooms.js";

const OCCUPIED_FROM = 65, FREE_BELOW = 25; // percent, as in map files
export const MOST_CORNERS = 60000;       // of outlines that are drawn at every frame
const THINNEST = 1.5;                    // CSS pixels: a wall is drawn no thinner
const SETTLED = 2000;                    // milliseconds without a change after which the rooms of a map are found
const ROOM_COLOURS = [[224, 122, 95], [110, 170, 140], [96, 150, 210], [226, 180, 80], [170, 130, 200], [90, 180, 190]];
const ROOM_ALPHA = 44;
const LETHAL = 254, INSCRIBED = 253, UNKNOWN_COST = 255;

export const isOccupied = (value) => value >= OCCUPIED_FROM;

export function mapColours(dark) {
  const table = new Uint32Array(256);
  const [free, wall] = dark ? [44, 205] : [255, 40];
  for (let value = 0; value <= 100; value++) table[value] = opaque(free + (wall - free) * value / 100);
  return table;                          // negative values, unknown, stay transparent
}

export function costColours() {
  const table = new Uint32Array(256);
  for (let cost = 1; cost < INSCRIBED; cost++) table[cost] = rgba(235, 150 - 0.2 * cost, 50, 8 + 0.22 * cost);
  table[INSCRIBED] = rgba(225, 90, 50, 84);
  table[LETHAL] = rgba(200, 40, 60, 120);
  table[UNKNOWN_COST] = 0;
  return table;
}

// Centimetres, from blue for up to 5 to red from 40 on, as in the picture of `chefbot map quality`.
export function errorColours() {
  const table = new Uint32Array(256);
  const limits = [[5, [44, 123, 182]], [10, [171, 217, 233]], [20, [255, 255, 191]], [40, [253, 174, 97]], [101, [215, 25, 28]]];
  for (let error = 0; error <= 100; error++) table[error] = rgba(...limits.find(([below]) => error < below)[1], 120);
  return table;
}

const opaque = (grey) => rgba(grey, grey, grey, 255);
const rgba = (r, g, b, a) => ((a << 24) | (b << 16) | (g << 8) | r) >>> 0;

export function picture(grid, table) {
  const canvas = document.createElement("canvas");
  canvas.width = grid.width;
  canvas.height = grid.height;
  const image = new ImageData(grid.width, grid.height);
  const pixels = new Uint32Array(image.data.buffer);
  for (let row = 0; row < grid.height; row++) {
    const from = row * grid.width, to = (grid.height - 1 - row) * grid.width;
    for (let column = 0; column < grid.width; column++) pixels[to + column] = table[grid.cells[from + column] & 255];
  }
  canvas.getContext("2d").putImageData(image, 0, 0);
  return canvas;
}

// The rectangle in metres that holds every known cell; the whole grid when none is known.
export function knownArea(grid) {
  let [left, right, bottom, top] = [grid.width, -1, grid.height, -1];
  grid.cells.forEach((value, i) => {
    if (value < 0) return;
    const column = i % grid.width, row = Math.floor(i / grid.width);
    left = Math.min(left, column); right = Math.max(right, column);
    bottom = Math.min(bottom, row); top = Math.max(top, row);
  });
  if (right < 0) [left, right, bottom, top] = [0, grid.width - 1, 0, grid.height - 1];
  const x = (column) => grid.x + column * grid.resolution, y = (row) => grid.y + row * grid.resolution;
  return { left: x(left), right: x(right + 1), bottom: y(bottom), top: y(top + 1) };
}

let latest = null;                       // map, with its regions or, if these have very many corners, its picture
let rooms = { grid: null, image: null, timer: null };   // of the map when it was last settled

// Known floor, doubtful cells and walls; what is unknown stays open.
export function drawMap(context, view, grid) {
  if (latest?.grid !== grid) tintWhenSettled(view, grid);
  if (latest?.grid !== grid || latest.dark !== isDark()) latest = prepared(grid);
  if (latest.image) drawGrid(context, view, grid, latest.image);
  else drawRegions(context, view, grid, latest.regions);
}

// Rooms are found once, not at each change of a map that grows.
function tintWhenSettled(view, grid) {
  clearTimeout(rooms.timer);
  rooms.timer = setTimeout(() => {
    const found = findRooms(grid, (value) => value >= 0 && value < FREE_BELOW, isOccupied);
    rooms = { grid: found, image: found && picture(found, roomColours()), timer: null };
    view.refresh();
  }, latest ? SETTLED : 0);
}

// The tint of the room at a point in metres, 0 where none is known; neighbouring rooms have different ones.
export function roomTint({ x, y }) {
  if (!rooms.grid) return 0;
  const { x: left, y: bottom, width, resolution, cells } = rooms.grid;
  const column = Math.floor((x - left) / resolution), row = Math.floor((y - bottom) / resolution);
  return column >= 0 && column < width ? cells[row * width + column] ?? 0 : 0;
}

function roomColours() {
  const table = new Uint32Array(256);
  ROOM_COLOURS.forEach((colour, tint) => { table[tint + 1] = rgba(...colour, ROOM_ALPHA); });
  return table;
}

function prepared(grid) {
  const regions = [
    [regionOutline(grid, (value) => value >= 0), COLOURS.floor()],
    [regionOutline(grid, (value) => value >= FREE_BELOW && value < OCCUPIED_FROM), COLOURS.doubtful()],
    [regionOutline(grid, isOccupied), COLOURS.wall()],
  ];
  const dark = isDark(), corners = regions.reduce((sum, [outline]) => sum + outline.corners, 0);
  return { grid, dark, regions, image: corners > MOST_CORNERS ? picture(grid, mapColours(dark)) : null };
}

function drawRegions(context, view, grid, regions) {
  const [x, y] = view.px(0, 0);
  context.save();
  context.translate(x, y);
  context.scale(view.scale, -view.scale);
  regions.forEach(([{ path }, colour], level) => {
    context.fillStyle = colour;
    context.fill(path, "evenodd");
    if (level === 0) drawRooms(context, path);
  });
  context.strokeStyle = COLOURS.wall();
  context.lineWidth = Math.max(0, THINNEST / view.scale - grid.resolution) || 0.2 * grid.resolution;
  context.lineJoin = "round";
  context.stroke(regions.at(-1)[0].path);
  context.restore();
}

// The tints of the rooms on the floor; the context measures in metres.
function drawRooms(context, floor) {
  if (!rooms.image) return;
  const { x, y, width, height, resolution } = rooms.grid;
  context.save();
  context.clip(floor, "evenodd");
  context.translate(x, y + height * resolution);
  context.scale(resolution, -resolution);
  context.imageSmoothingEnabled = false;
  context.drawImage(rooms.image, 0, 0, width, height);
  context.restore();
}

export function drawGrid(context, view, grid, image) {
  const size = grid.resolution * view.scale;
  context.save();
  context.translate(...view.px(grid.x, grid.y));
  context.rotate(-grid.yaw);
  context.imageSmoothingEnabled = false;
  context.drawImage(image, 0, -grid.height * size, grid.width * size, grid.height * size);
  context.restore();
}
