// The tree of frames (REP-105): joints from the robot description; frames received on /tf take precedence.
import { Euler, Group, Quaternion, Vector3 } from "three";
import { Glides } from "../glide.js";

const PRISMATIC = "prismatic", FIXED = "fixed";

export class FrameTree {
  constructor() {
    this.world = new Group();
    this.world.matrixAutoUpdate = false;
    this.groups = new Map();
    this.joints = new Map();
    this.received = new Set();
    this.glides = new Glides();
    this.fixed = "map";
  }

  has(name) { return this.groups.has(name); }

  // The group of map data: the map frame, or the root of the tree while that frame is unknown.
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

  // Add the joints of the URDF at position zero.
  describe(joints) {
    this.joints = new Map(joints.filter((joint) => joint.kind !== FIXED).map((joint) => [joint.name, joint]));
    for (const joint of joints) {
      if (this.received.has(joint.child)) continue;
      const turn = new Quaternion().setFromEuler(new Euler(...joint.rpy, "ZYX"));   // fixed axes x, y, z
      this.place(joint.child, joint.parent, joint.at, turn);
      Object.assign(joint, { at: new Vector3(...joint.at), turn, along: new Vector3(...joint.axis).normalize() });
    }
  }

  // From /tf and /tf_static.
  update(frames) {
    for (const { name, parent, at, turn } of frames ?? []) {
      const knew = this.received.has(name) && this.group(name).parent === this.group(parent);
      this.received.add(name);
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

  // Move joints to positions received from the robot, the shorter way round.
  follow(positions) {
    for (const [name, position] of Object.entries(positions ?? {})) {
      const joint = this.joints.get(name);
      if (!joint) continue;
      const from = joint.position ?? 0, travel = position - from;
      const short = joint.kind === PRISMATIC ? travel : Math.atan2(Math.sin(travel), Math.cos(travel));
      this.glides.to(`joint ${name}`, (share) => this.move(name, from + share * short));
    }
  }

  // Set a joint's position, rad, or m of a prismatic joint.
  move(name, position) {
    const joint = this.joints.get(name);
    if (!joint?.along || this.received.has(joint.child)) return;
    joint.position = position;
    const child = this.group(joint.child);
    if (joint.kind === PRISMATIC) child.position.copy(joint.along).multiplyScalar(position).applyQuaternion(joint.turn).add(joint.at);
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
