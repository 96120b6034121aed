// The tree of frames (REP-105): the description gives every joint, what /tf says of a frame goes before it.
import { Euler, Group, Quaternion, Vector3 } from "three";
import { Glides } from "./glide.js";

const SLIDES = "prismatic", STIFF = "fixed";

export class FrameTree {
  constructor() {
    this.world = new Group();
    this.world.matrixAutoUpdate = false;
    this.groups = new Map();
    this.joints = new Map();
    this.told = new Set();
    this.glides = new Glides();
    this.fixed = "map";
  }

  has(name) { return this.groups.has(name); }

  // Where the map's things are: in its frame, or at the tree's root as long as nobody knows where that is.
  get home() { return this.has("map") ? this.group("map") : this.world; }

  group(name) {
    if (!this.groups.has(name)) {
      const one = new Group();
      one.name = name;
      this.groups.set(name, one);
      this.world.add(one);
    }
    return this.groups.get(name);
  }

  // From the URDF: all joints at their zero.
  describe(joints) {
    this.joints = new Map(joints.filter((joint) => joint.kind !== STIFF).map((joint) => [joint.name, joint]));
    for (const joint of joints) {
      if (this.told.has(joint.child)) continue;
      const turn = new Quaternion().setFromEuler(new Euler(...joint.rpy, "ZYX"));   // fixed axes x, y, z
      this.place(joint.child, joint.parent, joint.at, turn);
      Object.assign(joint, { at: new Vector3(...joint.at), turn, along: new Vector3(...joint.axis).normalize() });
    }
  }

  // From /tf and /tf_static.
  tell(frames) {
    for (const { name, parent, at, turn } of frames ?? []) {
      const knew = this.told.has(name) && this.group(name).parent === this.group(parent);
      this.told.add(name);
      const end = new Quaternion(...turn);
      if (knew) this.glide(name, new Vector3(...at), end);
      else this.place(name, parent, at, end);
    }
  }

  glide(name, at, turn) {
    const one = this.group(name), from = one.position.clone(), start = one.quaternion.clone();
    this.glides.to(name, (share) => {
      one.position.lerpVectors(from, at, share);
      one.quaternion.slerpQuaternions(start, turn, share);
    });
  }

  place(name, parent, at, turn) {
    const child = this.group(name), above = this.group(parent);
    if (child.parent !== above && !isAbove(child, above)) above.add(child);
    child.position.set(...at);
    child.quaternion.copy(turn);
  }

  // The robot says where its joints are: the shorter way round to there.
  follow(positions) {
    for (const [name, position] of Object.entries(positions ?? {})) {
      const joint = this.joints.get(name);
      if (!joint) continue;
      const from = joint.position ?? 0, way = position - from;
      const short = joint.kind === SLIDES ? way : Math.atan2(Math.sin(way), Math.cos(way));
      this.glides.to(`joint ${name}`, (share) => this.move(name, from + share * short));
    }
  }

  // Radians, or metres of a joint that slides.
  move(name, position) {
    const joint = this.joints.get(name);
    if (!joint?.along || this.told.has(joint.child)) return;
    joint.position = position;
    const child = this.group(joint.child);
    if (joint.kind === SLIDES) child.position.copy(joint.along).multiplyScalar(position).applyQuaternion(joint.turn).add(joint.at);
    else child.quaternion.setFromAxisAngle(joint.along, position).premultiply(joint.turn);
  }

  // The fixed frame is where the world's origin is; an unknown one leaves the root of the tree there.
  settle() {
    this.world.matrix.identity();
    this.world.updateMatrixWorld(true);
    const still = this.groups.get(this.fixed);
    if (!still) return;
    this.world.matrix.copy(still.matrixWorld).invert();
    this.world.updateMatrixWorld(true);
  }
}

function isAbove(child, above) {
  for (let one = above; one; one = one.parent) if (one === child) return true;
  return false;
}
