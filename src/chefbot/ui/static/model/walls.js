// The map's occupied cells as low walls: sides along their straightened outlines, and a top cut out along the same lines.
import {
  BufferAttribute, BufferGeometry, CanvasTexture, Mesh, MeshLambertMaterial, PlaneGeometry, SRGBColorSpace,
} from "three";
import { COLOURS } from "../colours.js";
import { MOST_CORNERS, isOccupied } from "../grids.js";
import { regionOutline } from "../outlines.js";

const HEIGHT = 0.35;                     // metres: one looks over them at the robot
const FINENESS = 4, LARGEST = 4096;      // pixels of the top's picture, of a cell and of the longer side at most

export function walls(_layer, grid, live) {
  const { polygons, path, corners } = regionOutline(grid, isOccupied);
  if (!corners || corners > MOST_CORNERS) return null;
  const colour = COLOURS.solidWall();
  const sides = new Mesh(sidesGeometry(polygons), live.look("wall sides", () => new MeshLambertMaterial({ color: colour })));
  sides.add(top(grid, path, live.look("wall tops", () => new MeshLambertMaterial({ alphaTest: 0.5 }))));
  return sides;
}

// A rectangle on each edge of the polygons, whose region is on the left, facing outwards.
function sidesGeometry(polygons) {
  const edges = polygons.flatMap((polygon) => polygon.map((corner, i) => [corner, polygon[(i + 1) % polygon.length]]));
  const positions = new Float32Array(12 * edges.length), normals = new Float32Array(12 * edges.length), index = [];
  edges.forEach(([[ax, ay], [bx, by]], i) => {
    const long = Math.hypot(bx - ax, by - ay) || 1, [nx, ny] = [(by - ay) / long, (ax - bx) / long];
    positions.set([ax, ay, 0, bx, by, 0, bx, by, HEIGHT, ax, ay, HEIGHT], 12 * i);
    for (let k = 0; k < 4; k++) normals.set([nx, ny, 0], 12 * i + 3 * k);
    index.push(...[0, 1, 2, 0, 2, 3].map((k) => 4 * i + k));
  });
  const geometry = new BufferGeometry().setIndex(index);
  geometry.setAttribute("position", new BufferAttribute(positions, 3));
  return geometry.setAttribute("normal", new BufferAttribute(normals, 3));
}

function top(grid, path, look) {
  const { x, y, width, height, resolution } = grid, fineness = Math.min(FINENESS, LARGEST / Math.max(width, height));
  const picture = document.createElement("canvas"), context = picture.getContext("2d");
  picture.width = Math.ceil(fineness * width);
  picture.height = Math.ceil(fineness * height);
  context.setTransform(fineness / resolution, 0, 0, -fineness / resolution, -x * fineness / resolution, (y / resolution + height) * fineness);
  context.fillStyle = COLOURS.solidWall();
  context.fill(path, "evenodd");
  look.map?.dispose();
  look.map = new CanvasTexture(picture);
  look.map.colorSpace = SRGBColorSpace;
  const [wide, high] = [picture.width, picture.height].map((pixels) => pixels / fineness * resolution);
  const plane = new Mesh(new PlaneGeometry(wide, high), look);
  plane.position.set(x + wide / 2, y + height * resolution - high / 2, HEIGHT);
  return plane;
}
