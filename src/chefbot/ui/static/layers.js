// How each layer is drawn. `data` holds the latest value of every layer by name.
import { COLOURS } from "./colours.js";
import { costColours, drawGrid, drawMap, errorColours, picture } from "./grids.js";
import { title, tr } from "./language.js";
import { robot, truth } from "./robot.js";

export const SWITCHES = [
  ["map_error", tr("Estimated map error")], ["costmap", tr("Global costmap")], ["local_costmap", tr("Local costmap")], ["candidates", tr("Compared trajectories")], ["path", tr("Global plan")], ["local_path", tr("Local plan")], ["particles", tr("Particles")],
  ["scan", tr("Laser scan")], ["obstacles", tr("Camera obstacles")], ["people", tr("People")], ["places", tr("Places")], ["zones", tr("Zones")],
  ["causes", tr("Causes")], ["truth", tr("Ground truth (simulation)")],
];

const PATH_SPEED = 0.3;                  // metres per second, of the dashes

// Hidden until somebody wants to see them.
export const QUIET = ["map_error", "costmap", "local_costmap", "candidates", "particles"];

function raster(colours) {
  let latest = null;
  return (context, view, grid) => {
    if (latest?.grid !== grid) latest = { grid, image: picture(grid, colours()) };
    drawGrid(context, view, grid, latest.image);
  };
}

// From the best to the worst, and thin those from which the robot could not stop in time.
function candidates(context, view, { trajectories, badness }) {
  context.save();
  trajectories.map((points, i) => ({ points, bad: badness[i] })).sort((a, b) => (b.bad ?? 2) - (a.bad ?? 2)).forEach(({ points, bad }) => {
    context.strokeStyle = bad === null ? COLOURS.places() : `hsl(${Math.round(140 * (1 - Math.sqrt(bad)))} 80% 42%)`;
    context.globalAlpha = bad === null ? 0.25 : 0.75;
    context.lineWidth = bad === 0 ? 3 : 1;
    context.beginPath();
    for (let i = 0; i < points.length; i += 2) context.lineTo(...view.px(points[i], points[i + 1]));
    context.stroke();
  });
  context.restore();
}

// The cell that was requested.
function cell(context, view, { x, y, size }) {
  const [left, top] = view.px(x - size / 2, y + size / 2), side = Math.max(5, size * view.scale);
  context.strokeStyle = COLOURS.goal();
  context.lineWidth = 2;
  context.strokeRect(left, top, side, side);
}

function dots(layer, size) {
  return (context, view, value) => {
    context.fillStyle = COLOURS[layer]();
    for (let i = 0; i < value.count; i++) {
      const [x, y] = view.px(value.rows[2 * i], value.rows[2 * i + 1]);
      context.fillRect(x - size / 2, y - size / 2, size, size);
    }
  };
}

function line(layer, width) {
  return (context, view, value) => {
    context.strokeStyle = COLOURS[layer]();
    context.lineWidth = width;
    context.lineJoin = context.lineCap = "round";
    context.beginPath();
    for (let i = 0; i < value.count; i++) context.lineTo(...view.px(value.rows[2 * i], value.rows[2 * i + 1]));
    context.stroke();
  };
}

// The dashes move towards the goal.
function plannedPath(context, view, value) {
  const dash = Math.max(6, 0.18 * view.scale);
  context.save();
  context.globalAlpha = 0.3;
  line("path", 5)(context, view, value);
  context.globalAlpha = 1;
  context.setLineDash([dash, dash]);
  context.lineDashOffset = -PATH_SPEED * view.scale * (performance.now() / 1000 % (2 * dash / PATH_SPEED / view.scale));
  line("path", 3)(context, view, value);
  context.restore();
}

function particles(context, view, value) {
  const length = Math.max(4, 0.12 * view.scale);
  context.strokeStyle = COLOURS.particles();
  context.lineWidth = 1;
  context.beginPath();
  for (let i = 0; i < value.count; i++) {
    const [x, y] = view.px(value.rows[3 * i], value.rows[3 * i + 1]);
    const yaw = value.rows[3 * i + 2];
    context.moveTo(x, y);
    context.lineTo(x + length * Math.cos(yaw), y - length * Math.sin(yaw));
  }
  context.stroke();
}

export function arrow(context, view, pose, colour, length) {
  const [x, y] = view.px(pose.x, pose.y);
  context.save();
  context.translate(x, y);
  context.rotate(-pose.yaw);
  context.fillStyle = context.strokeStyle = colour;
  context.lineWidth = 3;
  context.beginPath();
  context.arc(0, 0, 4, 0, 2 * Math.PI);
  context.fill();
  context.beginPath();
  context.moveTo(0, 0);
  context.lineTo(length - 6, 0);
  context.stroke();
  context.beginPath();
  context.moveTo(length, 0);
  context.lineTo(length - 11, 6);
  context.lineTo(length - 11, -6);
  context.fill();
  context.restore();
}


function places(context, view, list) {
  const points = list.map((place) => view.px(place.x, place.y));
  context.fillStyle = COLOURS.places();
  for (const [x, y] of points) {
    context.beginPath();
    context.arc(x, y, 3.5, 0, 2 * Math.PI);
    context.fill();
    view.labels.reserve(x, y, 4);
  }
  list.forEach((place, i) => view.labels.write(title(place.name), ...points[i], COLOURS.places()));
}

// An outline with the title in its middle, and the direction of a one-way lane.
function zones(context, view, list) {
  for (const zone of list) {
    const corners = zone.corners.map(([x, y]) => view.px(x, y));
    const x = corners.reduce((sum, corner) => sum + corner[0], 0) / corners.length;
    const y = corners.reduce((sum, corner) => sum + corner[1], 0) / corners.length;
    context.strokeStyle = context.fillStyle = zoneColour(zone);
    context.lineWidth = 2;
    context.setLineDash(zone.kind === "keep_out" ? [] : [7, 4]);
    context.beginPath();
    for (const corner of corners) context.lineTo(...corner);
    context.closePath();
    context.stroke();
    context.save();
    context.globalAlpha = zone.kind === "keep_out" ? 0.15 : 0.05;
    context.fill();
    context.restore();
    context.setLineDash([]);
    if (zone.kind === "one_way") laneArrow(context, x, y + 14, zone.direction);
    view.labels.write(title(zone.title), x, y, zoneColour(zone));
  }
}

const zoneColour = ({ kind }) => (kind === "slow" ? COLOURS.zones : COLOURS[kind] ?? COLOURS.zones)();

function laneArrow(context, x, y, direction) {
  const dx = 14 * Math.cos(direction), dy = -14 * Math.sin(direction);
  velocityArrow(context, x - dx, y - dy, x + dx, y + dy);
}

const BODY_RADIUS = 0.2; // m
const ARROW_SECONDS = 1; // a velocity arrow ends where the person will be after that time

function people(context, view, list) {
  for (const person of list) {
    const [x, y] = view.px(person.x, person.y);
    const [bx, by] = view.px(person.x + ARROW_SECONDS * person.vx, person.y + ARROW_SECONDS * person.vy);
    const ring = Math.max(8, (BODY_RADIUS + 2 * person.deviation) * view.scale);
    context.save();
    context.globalAlpha = person.visible ? 1 : 0.45;
    context.fillStyle = context.strokeStyle = COLOURS.people();
    context.lineWidth = 2;
    context.beginPath();
    context.arc(x, y, Math.max(5, BODY_RADIUS * view.scale), 0, 2 * Math.PI);
    context.fill();
    context.setLineDash([3, 3]);
    context.beginPath();
    context.arc(x, y, ring, 0, 2 * Math.PI);
    context.stroke();
    context.setLineDash([]);
    if (Math.hypot(bx - x, by - y) > 8) velocityArrow(context, x, y, bx, by);
    view.labels.write(`#${person.id}`, x, y - ring, COLOURS.people());
    context.restore();
  }
}

function velocityArrow(context, x, y, bx, by) {
  const yaw = Math.atan2(by - y, bx - x);
  context.beginPath();
  context.moveTo(x, y);
  context.lineTo(bx, by);
  for (const side of [-1, 1]) {
    context.moveTo(bx, by);
    context.lineTo(bx - 7 * Math.cos(yaw + 0.5 * side), by - 7 * Math.sin(yaw + 0.5 * side));
  }
  context.stroke();
}

// A cross on each obstacle that holds the robot up now.
function causes(context, view, list) {
  context.strokeStyle = COLOURS.causes();
  context.lineWidth = 3;
  for (const cause of list) {
    if (cause.ended !== null || cause.x === null) continue;
    const [x, y] = view.px(cause.x, cause.y);
    context.beginPath();
    context.moveTo(x - 6, y - 6); context.lineTo(x + 6, y + 6);
    context.moveTo(x - 6, y + 6); context.lineTo(x + 6, y - 6);
    context.stroke();
  }
}

// In drawing order, the lowest layer first.
export const PAINTERS = [
  ["map", drawMap],
  ["map_error", raster(errorColours)],
  ["costmap", raster(costColours)],
  ["local_costmap", raster(costColours)],
  ["zones", zones],
  ["particles", particles],
  ["path", plannedPath],
  ["local_path", line("local_path", 3)],
  ["obstacles", dots("obstacles", 4)],
  ["scan", dots("scan", 3)],
  ["candidates", candidates],
  ["places", places],
  ["people", people],
  ["cell", cell],
  ["goal", (context, view, pose) => arrow(context, view, pose, COLOURS.goal(), Math.max(28, 0.6 * view.scale))],
  ["truth", truth],
  ["robot", robot],
  ["causes", causes],
];

// A line between two points on the map with their distance, as { start, end } in pixels.
export function ruler(context, view, { start, end }) {
  const from = view.metres(...start), to = view.metres(...end);
  context.save();
  context.strokeStyle = COLOURS.goal();
  context.lineWidth = 2;
  context.beginPath();
  context.moveTo(...start);
  context.lineTo(...end);
  context.stroke();
  context.restore();
  const degrees = Math.round((Math.atan2(to.y - from.y, to.x - from.x) * 180) / Math.PI);
  view.labels.write(`${Math.hypot(to.x - from.x, to.y - from.y).toFixed(2)} m, ${degrees}°`, ...end, COLOURS.goal(), 1);
}

export function scaleBar(context, view, above) {
  const metres = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50].find((length) => length * view.scale > 60) ?? 100;
  const width = metres * view.scale, y = view.height - above;
  context.fillStyle = COLOURS.halo();    // legible over walls, too
  context.fillRect(10, y - 20, width + 12, 26);
  context.strokeStyle = context.fillStyle = COLOURS.places();
  context.lineWidth = 2;
  context.beginPath();
  context.moveTo(16, y - 4); context.lineTo(16, y); context.lineTo(16 + width, y); context.lineTo(16 + width, y - 4);
  context.stroke();
  context.font = "12px system-ui, sans-serif";
  context.textAlign = "center";
  context.fillText(metres < 1 ? `${100 * metres} cm` : `${metres} m`, 16 + width / 2, y - 6);
}
