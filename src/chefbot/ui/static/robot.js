// The robot and its ground truth, drawn to scale from above.
import { COLOURS } from "./colours.js";

const UNKNOWN_SHAPE = { radius: 0.2, corners: [], wheels: [], cones: [] };
const SMALLEST = 9;                      // CSS pixels: the radius below which the robot is drawn larger than it is
const FAR = 4;                           // metres: a cone fades out there, though its sensor may see farther

const shapeOf = (data) => data.get("shape") ?? UNKNOWN_SHAPE;

const visibleScale = (view, shape) => Math.max(view.scale, SMALLEST / shape.radius);

// Run `draw()` with the axes of base_link, in metres.
function inBase(context, view, pose, scale, draw) {
  const [x, y] = view.px(pose.x, pose.y);
  context.save();
  context.translate(x, y);
  context.rotate(-pose.yaw);
  context.scale(scale, -scale);
  context.lineWidth = 1.5 / scale;
  draw();
  context.restore();
}

function tracePlate(context, { corners, radius }) {
  context.beginPath();
  if (!corners.length) context.arc(0, 0, radius, 0, 2 * Math.PI);
  for (const corner of corners) context.lineTo(...corner);
  context.closePath();
}

function traceHeading(context, { radius }) {
  context.beginPath();
  context.moveTo(0.8 * radius, 0);
  context.lineTo(0.3 * radius, 0.32 * radius);
  context.lineTo(0.42 * radius, 0);
  context.lineTo(0.3 * radius, -0.32 * radius);
  context.closePath();
}

function drawCones(context, { cones }) {
  for (const cone of cones) {
    const reach = Math.min(cone.range, FAR), half = cone.field_of_view / 2;
    const fade = context.createRadialGradient(cone.x, cone.y, 0, cone.x, cone.y, reach);
    fade.addColorStop(0, COLOURS.cone());
    fade.addColorStop(1, COLOURS.coneEnd());
    context.fillStyle = fade;
    context.beginPath();
    context.moveTo(cone.x, cone.y);
    context.arc(cone.x, cone.y, reach, cone.yaw - half, cone.yaw + half);
    context.fill();
  }
}

// The tray is the top plate; a dish stands on it while food is on board.
function drawBody(context, shape, loaded) {
  tracePlate(context, shape);
  context.fillStyle = COLOURS.robot();
  context.strokeStyle = COLOURS.halo();
  context.fill();
  context.stroke();
  context.fillStyle = COLOURS.tyre();
  for (const [x, y, length, width] of shape.wheels) context.fillRect(x - length / 2, y - width / 2, length, width);
  traceHeading(context, shape);
  context.fillStyle = COLOURS.heading();
  context.fill();
  if (loaded) drawDish(context, shape.radius);
}

function drawDish(context, radius) {
  context.beginPath();
  context.arc(-0.2 * radius, 0, 0.42 * radius, 0, 2 * Math.PI);
  context.fillStyle = COLOURS.dish();
  context.fill();
  context.strokeStyle = COLOURS.robot();
  context.beginPath();
  context.arc(-0.2 * radius, 0, 0.26 * radius, 0, 2 * Math.PI);
  context.stroke();
}

export function robot(context, view, pose, data) {
  const shape = shapeOf(data), loaded = data.get("delivery")?.loaded ?? false;
  inBase(context, view, pose, view.scale, () => drawCones(context, shape));
  inBase(context, view, pose, visibleScale(view, shape), () => drawBody(context, shape, loaded));
}

export function truth(context, view, pose, data) {
  const shape = shapeOf(data), scale = visibleScale(view, shape);
  inBase(context, view, pose, scale, () => {
    context.strokeStyle = COLOURS.truth();
    context.lineWidth = 2 / scale;
    context.setLineDash([5 / scale, 4 / scale]);
    tracePlate(context, shape);
    context.stroke();
    traceHeading(context, shape);
    context.stroke();
  });
}
