// Links and joints of a URDF text (http://wiki.ros.org/urdf/XML). Shapes are left out: the solids come as GLB.
import { tr } from "../language.js";

export function parseUrdf(text) {
  const tree = new DOMParser().parseFromString(text, "application/xml");
  if (tree.querySelector("parsererror")) throw new Error(tr("The robot's description is not XML."));
  const robot = tree.documentElement;
  if (robot.tagName !== "robot") throw new Error(tr("The robot's description is not a URDF."));
  return { links: childrenOf(robot, "link").map(link), joints: childrenOf(robot, "joint").map(joint) };
}

const childrenOf = (element, tag) => [...element.children].filter((child) => child.tagName === tag);

function link(element) {
  const mass = element.querySelector(":scope > inertial > mass")?.getAttribute("value");
  return { name: element.getAttribute("name"), mass: mass ? Number(mass) : null };
}

function joint(element) {
  const read = (tag, key) => element.querySelector(`:scope > ${tag}`)?.getAttribute(key);
  const kind = element.getAttribute("type");
  const endless = kind === "continuous", limit = (key, otherwise) => Number(read("limit", key) ?? otherwise);
  return {
    name: element.getAttribute("name"), kind, parent: read("parent", "link"), child: read("child", "link"),
    at: vector(read("origin", "xyz"), [0, 0, 0]), rpy: vector(read("origin", "rpy"), [0, 0, 0]),
    axis: vector(read("axis", "xyz"), [1, 0, 0]),
    lower: endless ? -Math.PI : limit("lower", 0), upper: endless ? Math.PI : limit("upper", 0),
  };
}

const vector = (words, otherwise) => words?.trim().split(/\s+/).map(Number) ?? otherwise;
