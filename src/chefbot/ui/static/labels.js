// Labels of the map: none covers another, and they fade out where the map is too small for them.
import { COLOURS } from "./colours.js";

const HEIGHT = 15, GAP = 8, MARGIN = 3;  // CSS pixels
const FADED_OUT = 5, READABLE = 11;      // CSS pixels per metre
const FONT = "12px system-ui, sans-serif";

export class Labels {
  constructor(context, view) {
    this.context = context;
    this.view = view;
    this.taken = [];
    this.opacity = Math.min(1, Math.max(0, (view.scale - FADED_OUT) / (READABLE - FADED_OUT)));
  }

  // Keep other labels off a disc, such as the mark of a place or the robot.
  reserve(x, y, radius) {
    this.taken.push({ left: x - radius, right: x + radius, top: y - radius, bottom: y + radius });
  }

  // Write a text above a point, or below, right or left of it; not at all where there is no room.
  write(text, x, y, colour, opacity = this.opacity) {
    const { context } = this;
    if (opacity <= 0) return;
    context.save();
    context.font = FONT;
    const box = this.room(context.measureText(text).width, x, y);
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

  room(textWidth, x, y) {
    const width = textWidth + 2 * MARGIN;
    const corners = [
      [x - width / 2, y - GAP - HEIGHT], [x - width / 2, y + GAP], [x + GAP, y - HEIGHT / 2], [x - GAP - width, y - HEIGHT / 2],
    ];
    const boxes = corners.map(([left, top]) => ({ left, top, right: left + width, bottom: top + HEIGHT }));
    return boxes.find((box) => this.inView(box) && !this.taken.some((other) => overlap(box, other)));
  }

  inView(box) {
    return box.left >= 0 && box.top >= 0 && box.right <= this.view.width && box.bottom <= this.view.height;
  }
}

const overlap = (a, b) => a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
