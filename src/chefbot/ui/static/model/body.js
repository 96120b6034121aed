// The robot's solids: a GLB whose nodes are named like links, each in its link's own frame.
import {
  Box3, BoxGeometry, Color, EdgesGeometry, Float32BufferAttribute, LineBasicMaterial, LineSegments, MeshPhongMaterial, Sphere, Vector3,
} from "three";
import { GLTFLoader } from "../vendor/three/loaders/GLTFLoader.js";

const EDGE = 32;                         // degrees between two faces that make an edge worth a line
const GLOW = new Color("#2dd4bf");

export class Body {
  constructor(frames) {
    this.frames = frames;
    this.links = new Map();              // link to the object that holds its meshes
    this.edges = new LineBasicMaterial({ color: 0x1d2522, transparent: true, opacity: 0.35 });
    this.chosen = null;
  }

  async load(url) {
    const answer = await fetch(url);
    if (!answer.ok) throw new Error(await answer.text());
    this.file = await new GLTFLoader().parseAsync(await answer.arrayBuffer(), "");
  }

  // Hang every link's node into its frame. What is no link stays with the link that it is part of.
  attach(links, base) {
    if (!this.file || this.links.size) return;
    const named = [];
    this.file.scene.traverse((node) => { if (links.has(nameOf(node))) named.push(node); });
    for (const node of named) this.hang(node, nameOf(node));
    (this.links.get(base) ?? this.frames.group(base)).add(this.file.scene);
    for (const node of this.links.values()) this.dress(node);
  }

  hang(node, link) {
    node.removeFromParent();
    node.position.set(0, 0, 0);
    node.quaternion.identity();
    node.userData.link = link;
    this.frames.group(link).add(node);
    if (!this.links.has(link)) this.links.set(link, node);
  }

  dress(node) {
    const meshes = [];
    node.traverse((one) => { if (one.isMesh) meshes.push(one); });
    for (const mesh of meshes) {
      mesh.castShadow = mesh.receiveShadow = true;
      mesh.material = matt(mesh.material);
      mesh.add(new LineSegments(new EdgesGeometry(mesh.geometry, EDGE), this.edges));
    }
  }

  show(on) { for (const node of this.links.values()) node.visible = on; }

  // The ball round all solids, in the world's coordinates; null without any.
  ball() {
    const box = new Box3();
    for (const node of this.links.values()) box.expandByObject(node);
    return box.isEmpty() ? null : box.getBoundingSphere(new Sphere());
  }

  // The chosen one glows, and shines through the others if it has a solid to see.
  choose(link) {
    this.chosen = link === this.chosen ? null : link;
    const seen = this.links.has(this.chosen);
    for (const [name, node] of this.links) {
      node.traverse((one) => { if (one.isMesh) light(one.material, name === this.chosen, seen && name !== this.chosen); });
    }
    return this.chosen;
  }

  // The link whose solid a ray meets first.
  pick(caster) {
    const visible = [...this.links.values()].filter((node) => node.visible);
    const hit = caster.intersectObjects(visible, true).find(({ object }) => object.isMesh);
    for (let one = hit?.object; one; one = one.parent) if (one.userData.link) return one.userData.link;
    return null;
  }
}

// Colours as given, without mirroring: a third of the work for who draws without a graphics card.
function matt({ color, map, vertexColors, flatShading, side, opacity, transparent }) {
  return new MeshPhongMaterial({ color, map, vertexColors, flatShading, side, opacity, transparent, specular: 0x222222, shininess: 24 });
}

function light(material, glowing, faint) {
  const own = (material.userData.own ??= { opacity: material.opacity, transparent: material.transparent });
  material.emissive.copy(GLOW);
  material.emissiveIntensity = glowing ? 0.45 : 0;
  material.opacity = faint ? 0.25 * own.opacity : own.opacity;
  material.transparent = faint || own.transparent;
  material.depthWrite = !material.transparent;
  material.needsUpdate = true;           // its program knows whether it is opaque
}

const nameOf = (node) => node.userData.name ?? node.name;   // the loader makes names unique; the file's own is kept

// Three bars from the origin along x, y, z: red, green, blue.
export function axesGeometry(length) {
  const thick = 0.045 * length, colours = ["#d63a3a", "#2f9e44", "#3262d8"].map((text) => new Color(text));
  const parts = [0, 1, 2].map((axis) => {
    const size = [thick, thick, thick], middle = [0, 0, 0];
    size[axis] = length;
    middle[axis] = length / 2;
    return new BoxGeometry(...size).translate(...middle).toNonIndexed();
  });
  const [all, ...rest] = parts;
  const positions = parts.flatMap((part) => [...part.attributes.position.array]);
  const tints = parts.flatMap((part, axis) => Array.from({ length: part.attributes.position.count }, () => colours[axis].toArray()).flat());
  all.deleteAttribute("uv");
  all.deleteAttribute("normal");
  all.setAttribute("position", new Float32BufferAttribute(positions, 3));
  all.setAttribute("color", new Float32BufferAttribute(tints, 3));
  all.computeBoundingSphere();
  for (const part of rest) part.dispose();
  return all;
}

export const origin = (group) => new Vector3().setFromMatrixPosition(group.matrixWorld);
