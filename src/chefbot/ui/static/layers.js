// How each layer is drawn. `data` holds the latest value of every layer by name.
import { costColours, drawGrid, mapColours, picture } from "./grids.js";

const dark = window.matchMedia("(prefers-color-scheme: dark)");
const pick = (light, darker) => (dark.matches ? darker : light);

export const COLOURS = {
  path: () => pick("#0f766e", "#2dd4bf"),
  local_path: () => pick("#7c3aed", "#a78bfa"),
  particles: () => pick("#2563eb99", "#60a5faaa"),
  scan: () => pick("#dc2626", "#f87171"),
  obstacles: () => pick("#d97706", "#fbbf24"),
  goal: () => pick("#0f766e", "#2dd4bf"),
  truth: () => pick("#16a34a", "#4ade80"),
  people: () => pick("#be185d", "#f472b6"),
  robot: () => pick("#1d2522", "#e6ebe8"),
  costmap: () => "#e0592b",
  places: () => pick("#66716c", "#96a39d"),
  causes: () => pick("#be123c", "#fb7185"),
  zones: () => pick("#b45309", "#f59e0b"),
};

const ZONE_COLOURS = {
  keep_out: () => pick("#b91c1c", "#f87171"),
  slow: () => COLOURS.zones(),
  preferred: () => pick("#15803d", "#4ade80"),
  one_way: () => pick("#1d4ed8", "#60a5fa"),
};

export const SWITCHES = [
  ["costmap", "Global costmap"], ["path", "Global plan"], ["local_path", "Local plan"], ["particles", "Particles"],
  ["scan", "Laser scan"], ["obstacles", "Camera obstacles"], ["people", "People"], ["places", "Places"], ["zones", "Zones"],
  ["causes", "Causes"], ["truth", "Ground truth (simulation)"],
];

const images = new Map();

function gridPainter(layer, colours) {
  return (context, view, grid) => {
    const known = images.get(layer);
    if (!known || known.grid !== grid || known.dark !== dark.matches) {
      images.set(layer, { grid, dark: dark.matches, image: picture(grid, colours(dark.matches)) });
    }
    drawGrid(context, view, grid, images.get(layer).image);
  };
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

function outline(context, view, pose, radius) {
  const [x, y] = view.px(pose.x, pose.y);
  const size = Math.max(7, radius * view.scale);
  context.beginPath();
  context.arc(x, y, size, 0, 2 * Math.PI);
  return [x, y, size];
}

function headingMark(context, pose, x, y, size) {
  const corner = (turn, far) => [x + far * size * Math.cos(pose.yaw + turn), y - far * size * Math.sin(pose.yaw + turn)];
  context.beginPath();
  context.moveTo(...corner(0, 0.8));
  context.lineTo(...corner(2.4, 0.62));
  context.lineTo(...corner(Math.PI, 0.25));
  context.lineTo(...corner(-2.4, 0.62));
  context.closePath();
}

function robot(context, view, pose) {
  const [x, y, size] = outline(context, view, pose, pose.radius);
  context.fillStyle = COLOURS.robot();
  context.fill();
  context.lineWidth = 2;
  context.strokeStyle = pick("#ffffff", "#121614");
  context.stroke();
  headingMark(context, pose, x, y, size);
  context.fillStyle = pick("#5eead4", "#0f766e");
  context.fill();
}

function truth(context, view, pose, data) {
  const place = outline(context, view, pose, data.get("robot")?.radius ?? 0.2);
  context.strokeStyle = COLOURS.truth();
  context.lineWidth = 2;
  context.setLineDash([5, 4]);
  context.stroke();
  headingMark(context, pose, ...place);
  context.stroke();
  context.setLineDash([]);
}

export const title = (name) => name.replace(/_/g, " ").replace(/^./, (letter) => letter.toUpperCase());

function places(context, view, list) {
  context.font = "12px system-ui, sans-serif";
  context.textAlign = "center";
  for (const place of list) {
    const [x, y] = view.px(place.x, place.y);
    context.fillStyle = COLOURS.places();
    context.beginPath();
    context.arc(x, y, 3.5, 0, 2 * Math.PI);
    context.fill();
    context.lineWidth = 3;
    context.strokeStyle = pick("#ffffffcc", "#121614cc");
    context.strokeText(title(place.name), x, y - 8);
    context.fillText(title(place.name), x, y - 8);
  }
}

// An outline with the title in its middle, and the direction of a one-way lane.
function zones(context, view, list) {
  context.font = "12px system-ui, sans-serif";
  context.textAlign = "center";
  for (const zone of list) {
    const corners = zone.corners.map(([x, y]) => view.px(x, y));
    const x = corners.reduce((sum, corner) => sum + corner[0], 0) / corners.length;
    const y = corners.reduce((sum, corner) => sum + corner[1], 0) / corners.length;
    context.strokeStyle = context.fillStyle = (ZONE_COLOURS[zone.kind] ?? COLOURS.zones)();
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
    context.lineWidth = 3;
    context.strokeStyle = pick("#ffffffcc", "#121614cc");
    context.strokeText(title(zone.title), x, y);
    context.fillText(title(zone.title), x, y);
  }
}

function laneArrow(context, x, y, direction) {
  const dx = 14 * Math.cos(direction), dy = -14 * Math.sin(direction);
  velocityArrow(context, x - dx, y - dy, x + dx, y + dy);
}

const BODY_RADIUS = 0.2; // m
const ARROW_SECONDS = 1; // a velocity arrow ends where the person will be after that time

function people(context, view, list) {
  context.font = "600 12px system-ui, sans-serif";
  context.textAlign = "center";
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
    context.lineWidth = 3;
    context.strokeStyle = pick("#ffffffcc", "#121614cc");
    const above = y - ring - 5;
    context.strokeText(`#${person.id}`, x, above);
    context.fillText(`#${person.id}`, x, above);
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
  ["map", gridPainter("map", mapColours)],
  ["costmap", gridPainter("costmap", costColours)],
  ["zones", zones],
  ["particles", particles],
  ["path", line("path", 4)],
  ["local_path", line("local_path", 3)],
  ["obstacles", dots("obstacles", 4)],
  ["scan", dots("scan", 3)],
  ["places", places],
  ["people", people],
  ["goal", (context, view, pose) => arrow(context, view, pose, COLOURS.goal(), Math.max(28, 0.6 * view.scale))],
  ["truth", truth],
  ["robot", robot],
  ["causes", causes],
];

export function scaleBar(context, view, above) {
  const metres = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50].find((length) => length * view.scale > 60) ?? 100;
  const width = metres * view.scale, y = view.height - above;
  context.strokeStyle = context.fillStyle = COLOURS.places();
  context.lineWidth = 2;
  context.beginPath();
  context.moveTo(16, y - 4); context.lineTo(16, y); context.lineTo(16 + width, y); context.lineTo(16 + width, y - 4);
  context.stroke();
  context.font = "12px system-ui, sans-serif";
  context.textAlign = "center";
  context.fillText(metres < 1 ? `${100 * metres} cm` : `${metres} m`, 16 + width / 2, y - 6);
}
