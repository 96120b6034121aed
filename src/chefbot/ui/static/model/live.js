// What the robot sees and means to do, in 3-D: the map on the floor, paths, scans, the depth camera's points.
import {
  BufferAttribute, BufferGeometry, CanvasTexture, Color, DoubleSide, Group, Mesh, MeshBasicMaterial, NearestFilter,
  PlaneGeometry, Points, PointsMaterial, RingGeometry, Shape, ShapeGeometry, SRGBColorSpace, Vector2,
} from "three";
import { COLOURS } from "../colours.js";
import { costColours, mapColours, picture } from "../grids.js";
import { walls } from "./walls.js";

const DARK = window.matchMedia("(prefers-color-scheme: dark)");
const ORDER = { map: -8, costmap: -7, path: -4, local_path: -3, truth: -2, goal: -1 };   // floor from the ground up
const ARROW = [[-0.03, -0.025], [0.3, -0.025], [0.3, -0.09], [0.5, 0], [0.3, 0.09], [0.3, 0.025], [-0.03, 0.025]];
const NEAR = new Color("#e2572b"), MIDDLE = new Color("#d9b62c"), FAR = new Color("#3262d8");

export class Live {
  constructor(frames) {
    this.frames = frames;
    this.sheets = new Group();           // in the map's frame
    this.objects = new Map();
    this.looks = new Map();
    this.radius = 0.2;                   // metres, of the ring where the robot really is
    this.sheets.name = "live";
  }

  // One material per layer for good: with a new one at each news its shader would be compiled ten times a second.
  look(layer, make) {
    if (!this.looks.has(layer)) this.looks.set(layer, make());
    return this.looks.get(layer);
  }

  // Colour scheme changed: create all materials again.
  repaint(data) {
    for (const look of this.looks.values()) { look.map?.dispose(); look.dispose(); }
    this.looks.clear();
    for (const [layer, value] of data) this.take(layer, value);
  }

  // Whether there is something new to draw.
  take(layer, value) {
    if (layer === "shape") this.size(value);
    const maker = MAKERS[layer];
    if (!maker) return false;
    if (this.sheets.parent !== this.frames.home) this.frames.home.add(this.sheets);
    if (layer === "truth" && value && this.objects.has(layer)) return this.glide(this.objects.get(layer), value);
    if (layer === "map") this.take("walls", value);
    this.drop(layer);
    const object = value && maker(layer, value, this);
    if (!object) return true;
    object.name = layer;
    (value.kind === "depth" ? this.frames.group(value.frame) : this.sheets).add(object);
    this.objects.set(layer, object);
    return true;
  }

  size(shape) {
    if (!shape) return;
    this.radius = shape.radius;
    this.objects.get("truth")?.scale.setScalar(this.radius);
  }

  // The ring goes as smoothly as the robot beside it.
  glide(ring, { x, y }) {
    const { x: x0, y: y0 } = ring.position;
    this.frames.glides.to("truth", (share) => ring.position.set(x0 + share * (x - x0), y0 + share * (y - y0), 0));
    return true;
  }

  drop(layer) {
    const before = this.objects.get(layer);
    before?.removeFromParent();
    before?.traverse((part) => part.geometry.dispose());
    this.objects.delete(layer);
  }

  show(hidden) { for (const [layer, object] of this.objects) object.visible = !hidden.has(layer); }
}

function sheet(colours) {
  return (layer, grid, live) => {
    const texture = new CanvasTexture(picture(grid, colours(DARK.matches)));
    texture.magFilter = NearestFilter;
    texture.colorSpace = SRGBColorSpace;
    const wide = grid.width * grid.resolution, high = grid.height * grid.resolution;
    const look = live.look(layer, () => flat({ map: texture, toneMapped: false }));
    if (look.map !== texture) look.map.dispose();
    look.map = texture;
    const plane = new Mesh(new PlaneGeometry(wide, high), look);
    plane.position.set(grid.x + wide / 2, grid.y + high / 2, 0);
    plane.renderOrder = ORDER[layer];
    return plane;
  };
}

const flat = (more) => new MeshBasicMaterial({ transparent: true, depthWrite: false, side: DoubleSide, ...more });

// A line on the floor, as wide as a finger.
function ribbon(width) {
  return (layer, { rows, count }, live) => {
    if (count < 2) return null;
    const positions = new Float32Array(6 * count), index = [];
    for (let i = 0; i < count; i++) {
      const a = 2 * Math.max(0, i - 1), b = 2 * Math.min(count - 1, i + 1);
      const dx = rows[b] - rows[a], dy = rows[b + 1] - rows[a + 1], long = Math.hypot(dx, dy) || 1;
      const [x, y, nx, ny] = [rows[2 * i], rows[2 * i + 1], -dy / long * width / 2, dx / long * width / 2];
      positions.set([x + nx, y + ny, 0, x - nx, y - ny, 0], 6 * i);
      if (i) index.push(2 * i - 2, 2 * i - 1, 2 * i, 2 * i, 2 * i - 1, 2 * i + 1);
    }
    const geometry = new BufferGeometry().setAttribute("position", new BufferAttribute(positions, 3)).setIndex(index);
    const line = new Mesh(geometry, live.look(layer, () => flat({ color: COLOURS[layer](), toneMapped: false })));
    line.renderOrder = ORDER[layer];
    return line;
  };
}

// Ends of beams, at the height of the sensor that saw them.
function beams(size) {
  return (layer, { rows, count, frame }, live) => {
    const high = live.frames.has(frame) ? heightOver(live.frames.group(frame), live.frames) : 0;
    const positions = new Float32Array(3 * count);
    for (let i = 0; i < count; i++) positions.set([rows[2 * i], rows[2 * i + 1], high], 3 * i);
    return dots(positions, live.look(layer, () => dotted({ size, color: COLOURS[layer]() })));
  };
}

function heightOver(sensor, frames) {
  frames.settle();
  return frames.home.worldToLocal(sensor.getWorldPosition(sensor.position.clone())).z;
}

function dots(positions, look) {
  const geometry = new BufferGeometry().setAttribute("position", new BufferAttribute(positions, 3));
  return new Points(geometry, look);
}

const dotted = (more) => new PointsMaterial({ sizeAttenuation: false, toneMapped: false, ...more });

// A depth picture as points of its optical frame (REP-103: z ahead, x right, y down), warm is near.
function cloud(layer, { millimetres, width, focal, cx, cy }, live) {
  const positions = [], colours = [], tint = new Color();
  millimetres.forEach((depth, i) => {
    if (!depth) return;
    const z = depth / 1000, column = i % width, row = (i - column) / width;
    positions.push((column - cx) * z / focal, (row - cy) * z / focal, z);
    const share = Math.min(1, Math.max(0, (z - 0.4) / 4.6));
    if (share < 0.5) tint.lerpColors(NEAR, MIDDLE, 2 * share); else tint.lerpColors(MIDDLE, FAR, 2 * share - 1);
    colours.push(tint.r, tint.g, tint.b);
  });
  const points = dots(new Float32Array(positions), live.look(layer, () => dotted({ size: 3, vertexColors: true })));
  points.geometry.setAttribute("color", new BufferAttribute(new Float32Array(colours), 3));
  return points;
}

// From where the robot shall stand to where it shall look.
function goal(_layer, pose, live) {
  const look = live.look("goal", () => flat({ color: COLOURS.goal(), toneMapped: false }));
  const arrow = new Mesh(new ShapeGeometry(new Shape(ARROW.map(([x, y]) => new Vector2(x, y)))), look);
  arrow.position.set(pose.x, pose.y, 0);
  arrow.rotation.z = pose.yaw;
  arrow.renderOrder = ORDER.goal;
  return arrow;
}

function particles(layer, { rows, count }, live) {
  const positions = new Float32Array(3 * count);
  for (let i = 0; i < count; i++) positions.set([rows[3 * i], rows[3 * i + 1], 0.005], 3 * i);
  return dots(positions, live.look(layer, () => dotted({ size: 2, color: COLOURS[layer]().slice(0, 7) })));   // no alpha
}

function truth(layer, pose, live) {
  const look = live.look(layer, () => flat({ color: COLOURS[layer](), toneMapped: false }));
  const ring = new Mesh(new RingGeometry(1, 1.035, 64), look);
  ring.scale.setScalar(live.radius);
  ring.position.set(pose.x, pose.y, 0);
  ring.renderOrder = ORDER[layer];
  return ring;
}

const MAKERS = {
  map: sheet(mapColours), walls, costmap: sheet(costColours), path: ribbon(0.03), local_path: ribbon(0.02),
  scan: beams(4), obstacles: beams(4), particles, depth: cloud, goal, aim: goal, truth,
};
