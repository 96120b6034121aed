// Where the robot is, in a sentence for those who cannot see the map.
import { title, tr } from "./language.js";

const SLOWEST = 0.05;                    // metres per second: slower, a time of arrival would mean nothing
const HERE = 0.3;                        // metres from a place at which the robot is there

export function whereSentence(data) {
  const robot = data.get("robot"), places = data.get("places") ?? [];
  if (!robot) return tr("The robot does not know where it is.");
  return [position(robot, places), motion(robot, data.get("stop")?.stopped ? null : data.get("path"), goalName(data.get("goal"), places))].join(" ");
}

function position(robot, places) {
  const [nearest] = places.map((place) => [distance(robot, place), place]).sort(([a], [b]) => a - b);
  if (!nearest) return tr("The robot is at x {x} m, y {y} m.", { x: robot.x.toFixed(1), y: robot.y.toFixed(1) });
  const [far, place] = nearest;
  const values = { metres: metres(far), place: title(place.name) };
  return far < HERE ? tr("The robot is at {place}.", values) : tr("The robot is {metres} from {place}.", values);
}

function motion(robot, path, goal) {
  if (!path?.count) {
    return Math.abs(robot.v) < SLOWEST ? tr("It is stopped.") : tr("It is moving at {speed} m/s.", { speed: Math.abs(robot.v).toFixed(1) });
  }
  const left = lengthAhead(robot, path);
  const values = { goal, metres: metres(left), seconds: Math.max(1, Math.round(left / robot.v)) };
  return robot.v > SLOWEST ? tr("It is on its way to {goal}: {metres} to go, about {seconds} s.", values)
    : tr("It is on its way to {goal}: {metres} to go.", values);
}

function goalName(goal, places) {
  const place = goal && places.find((one) => distance(one, goal) < HERE);
  return place ? title(place.name) : tr("a point on the map");
}

// The length of a path from the point that is nearest to the robot.
function lengthAhead(robot, { rows, count }) {
  const point = (i) => ({ x: rows[2 * i], y: rows[2 * i + 1] });
  let nearest = 0, left = 0;
  for (let i = 1; i < count; i++) if (distance(robot, point(i)) < distance(robot, point(nearest))) nearest = i;
  for (let i = nearest + 1; i < count; i++) left += distance(point(i - 1), point(i));
  return left;
}

const distance = (a, b) => Math.hypot(a.x - b.x, a.y - b.y);
const metres = (length) => (length < 10 ? `${length.toFixed(1)} m` : `${Math.round(length)} m`);
