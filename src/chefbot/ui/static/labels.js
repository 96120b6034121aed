// Labels of the map: none covers another, and they fade out where the map is too small for them.
import { COLOURS } from "./colours.js";

const HEIGHT = 15, GAP = 8, MARGIN = 3;  // CSS pixels
const FADED_OUT = 5, READABLE = 11;      // CSS pixels per metre
const FONT = "12px system-ui, sans-serif";

export class Labels {
  // `roomAt` returns the room at a point of the canvas, 0 where none is known.
  constructor(context, view, roomAt = () => 0) {
    this.context = context;
    this.view = view;
    this.roomAt = roomAt;
    this.taken = [];
    this.opacity = Math.min(1, Math.max(0, (view.scale - FADED_OUT) / (READABLE - FADED_OUT)));
  }

  // Keep other labels off a disc, such as the mark of a place or the robot.
  reserve(x, y, radius) {
    this.taken.push({ left: x - radius, right: x + radius, top: y - radius, bottom: y + radius });
  }

  // Write a text above a point, or below, right or left of it, in its room if possible; not at all where there is no space.
  write(text, x, y, colour, opacity = this.opacity) {
    const { context } = this;
    if (opacity <= 0) return;
    context.save();
    context.font = FONT;
    const box = this.freeBox(context.measureText(text).width, x, y);
    if (box) {
      this.taken.push(box);
      context.globalAlpha *= opacity;
      context.textAlign = "left";
      context.direction = document.documentElement.dir;
      context.textBaseline = "middle";
      context.lineWidth = 3;
      context.lineJoin = "round";
      context.strokeStyle = COLOURS.halo();
      context.fillStyle = colour;
      context.strokeText(text, box.left + MARGIN, (box.top + box.bottom) / 2);
      context.fillText(text, box.left + MARGIN, (box.top + box.bottom) / 2);
    }
    context.restore();
  }

  freeBox(textWidth, x, y) {
    const width = textWidth + 2 * MARGIN;
    const corners = [
      [x - width / 2, y - GAP - HEIGHT], [x - width / 2, y + GAP], [x + GAP, y - HEIGHT / 2], [x - GAP - width, y - HEIGHT / 2],
    ];
    const boxes = corners.map(([left, top]) => ({ left, top, right: left + width, bottom: top + HEIGHT }));
    const free = boxes.filter((box) => this.inView(box) && !this.taken.some((other) => overlap(box, other)));
    const room = this.roomAt(x, y), outside = free.map((box) => (room ? this.pointsOutside(box, room) : 0));
    return free[outside.indexOf(Math.min(...outside))];
  }

  // The number of points on the middle line of a box that are in another room.
  pointsOutside({ left, right, top, bottom }, room) {
    const rooms = [left, (left + right) / 2, right].map((x) => this.roomAt(x, (top + bottom) / 2));
    return rooms.filter((other) => other && other !== room).length;
  }

  inView(box) {
    return box.left >= 0 && box.top >= 0 && box.right <= this.view.width && box.bottom <= this.view.height;
  }
}

const overlap = (a, b) => a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
