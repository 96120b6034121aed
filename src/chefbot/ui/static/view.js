// The map: where it is looked at from, and the gestures that move it. Metres to pixels and back; y goes up.

const MIN_SCALE = 4, MAX_SCALE = 600;
const SMALL = 0.8;                       // share of the largest scale: a map that is smaller is drawn larger again

export class View {
  // `resized(inPlace)` is called when the canvas has got its size, and whenever that changes.
  constructor(canvas, draw, resized = () => {}) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.draw = draw;
    this.centre = { x: 0, y: 0 };
    this.scale = 50;                     // CSS pixels per metre
    this.pending = false;
    this.resized = resized;
    this.box = null;                     // of the canvas in the window, and the height of the window
    this.lift = 0;                       // pixels by which the middle of the column is above that of the canvas
    new ResizeObserver(() => this.resize()).observe(canvas);
    canvas.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
  }

  // A canvas of another size is empty, so it is painted in the same frame.
  resize() {
    const ratio = window.devicePixelRatio || 1, inPlace = this.keepInPlace();
    this.width = this.canvas.clientWidth;
    this.height = this.canvas.clientHeight;
    this.canvas.width = Math.round(this.width * ratio);
    this.canvas.height = Math.round(this.height * ratio);
    this.ratio = ratio;
    this.resized(inPlace);
    this.paint();
  }

  // A warning that comes or goes above the canvas does not move the map under a finger. Returns whether that is the case.
  keepInPlace() {
    const { top, width, height } = this.canvas.getBoundingClientRect(), before = this.box;
    const column = this.canvas.closest("#map-column").getBoundingClientRect();
    this.lift = top + height / 2 - (column.top + column.height / 2);
    this.box = { middle: top + height / 2, width, window: window.innerHeight };
    if (!before?.width || before.width !== width || before.window !== window.innerHeight) return false;
    this.centre.y -= (this.box.middle - before.middle) / this.scale;
    return true;
  }

  refresh() {
    if (this.pending) return;
    this.pending = true;
    requestAnimationFrame(() => {
      this.pending = false;
      this.paint();
    });
  }

  paint() {
    this.context.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    this.context.clearRect(0, 0, this.width, this.height);
    this.draw(this.context, this);
  }

  px(x, y) {
    return [this.width / 2 + (x - this.centre.x) * this.scale, this.height / 2 - (y - this.centre.y) * this.scale];
  }

  metres(px, py) {
    return {
      x: this.centre.x + (px - this.width / 2) / this.scale,
      y: this.centre.y - (py - this.height / 2) / this.scale,
    };
  }

  at(event) {
    const box = this.canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  pan(dx, dy) {
    this.centre.x -= dx / this.scale;
    this.centre.y += dy / this.scale;
    this.refresh();
  }

  look(x, y, scale) {
    this.centre = { x, y };
    this.scale = Math.min(MAX_SCALE, Math.max(MIN_SCALE, scale));
    this.refresh();
  }

  // Keep a point in the middle of the column, which does not move when a warning comes or goes.
  track({ x, y }) { this.centre = { x, y: y - this.lift / this.scale }; }

  zoom(factor, px, py) {
    const before = this.metres(px, py);
    this.scale = Math.min(MAX_SCALE, Math.max(MIN_SCALE, this.scale * factor));
    const after = this.metres(px, py);
    this.centre.x += before.x - after.x;
    this.centre.y += before.y - after.y;
    this.refresh();
  }

  wheel(event) {
    event.preventDefault();
    this.zoom(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0015)), ...this.at(event));
  }

  // Whether an area is in sight and not much smaller than it could be. `above` and `below`: pixels that buttons cover.
  shows(area, above, below) {
    const [left, top] = this.px(area.left, area.top), [right, bottom] = this.px(area.right, area.bottom);
    const inSight = left >= 0 && right <= this.width && top >= above && bottom <= this.height - below;
    return inSight && this.scale > SMALL * this.largest(area, above, below);
  }

  // The scale at which an area fills what is free of the canvas.
  largest(area, above, below) {
    const wide = area.right - area.left, high = area.top - area.bottom;
    const free = Math.max(this.height / 3, this.height - above - below);
    return Math.min(MAX_SCALE, 0.94 * Math.min(this.width / wide, free / high));
  }

  fit(area, above, below) {
    this.scale = this.largest(area, above, below);
    this.centre = { x: (area.left + area.right) / 2, y: (area.bottom + area.top) / 2 + (above - below) / 2 / this.scale };
    this.refresh();
  }
}
