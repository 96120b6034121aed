// Connects the parts: the link passes layers to the map and the panels; gestures and buttons send commands.
import { ViewAddress } from "./address.js";
import { Alerts } from "./alerts.js";
import { cellSentence } from "./cell.js";
import { COLOURS } from "./colours.js";
import { Driver } from "./drive.js";
import { Glides } from "./glide.js";
import { knownArea, roomTint } from "./grids.js";
import { Incidents } from "./incidents.js";
import { Inspect } from "./inspect.js";
import { Kiosk } from "./kiosk.js";
import { Labels } from "./labels.js";
import { LANGUAGES, choose, language, loadError, setLabels, tr, translated } from "./language.js";
import { PAINTERS, QUIET, SWITCHES, arrow, ruler, scaleBar } from "./layers.js";
import { MapCursor } from "./map_cursor.js";
import { MapEdit } from "./map_edit.js";
import { keepOnDevice } from "./offline.js";
import { Overlay } from "./overlay.js";
import { Panels } from "./panels.js";
import { Playback } from "./playback.js";
import { showRole } from "./role.js";
import { Link } from "./socket.js";
import { Solid } from "./solid.js";
import { StopButton } from "./stop_button.js";
import { Tools } from "./tools.js";
import { View } from "./view.js";
import { whereSentence } from "./where.js";

const STALE = 2000;                      // milliseconds without data before the web UI reports it
const $ = (id) => document.getElementById(id);
const JUMP = 0.5;                        // metres: a pose that is farther from the last is drawn at once
const NEEDED = ["shape", "map", "robot", "goal", "labels", "places", "zones", "mapping", "launch", "edits", "delivery", "forecast", "history", "causes", "incidents", "progress", "playback", "cell"];
const SOLID_LAYERS = ["frames", "fixed_frames", "joints", "description", "depth"];
const OF_THE_ROBOT = new Set(["stop", "shape", ...SOLID_LAYERS]);        // the same after a restart
const OLD = 500;                         // milliseconds: the age from which the view shows how old it is
const MAP_PATIENCE = 3000;               // milliseconds: a first picture is drawn without its map if that takes longer
const WHERE_SHOWN = 20000;               // milliseconds
const STILL = window.matchMedia("(prefers-reduced-motion: reduce)");
const data = new Map();
const hidden = new Set(QUIET);
const glides = new Glides();
const shown = new Map();                 // poses on the way from their last value to the latest
let following = true, whole = true, lastData = 0, refusal = 0, whereAsked = 0, failures = null, refusals = null, keepNotice = false;
let complete = false;                    // whether the map has arrived, if there is one: places alone would jump
let viewsBelow = false;                  // whether buttons lie below the map, too
let cameraInView = false, solid = null, kiosk = null, inspect = null, address = null;
let lasting = "";                        // a notice that only a person closes
let unserved = "";                       // tables of a round of which a restarted server has not reported yet

const link = new Link(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/live`, shownLayers);
const view = new View($("canvas"), paint, resized);
const panels = new Panels(send);
const driver = new Driver((command) => link.send(command));
const stop = new StopButton((command) => link.send(command), () => { driver.release(); panels.round.answer(""); });
const incidents = new Incidents(send);
const playback = new Playback(send);
new Overlay("manual");
const alerts = new Alerts($("alerts"));
const tools = new Tools(view, gesture, lookAway, () => data.get("robot"), draw);
inspect = new Inspect((command) => link.open && link.send(command), () => link.show());
const cursor = new MapCursor(view, tools, data, { whole: fit, zoomed: () => { whole = false; }, lookAway });
const mapEdit = new MapEdit(send, (tool) => tools.choose(tool), () => data.get("robot"), () => view.refresh());
solid = new Solid({
  data, hidden, tools, showNotice, following: () => following,
  turned: (on) => { panels.open(on ? "model-panel" : "serve"); link.show(); address?.write(); },
});

// Layers that are shown now, or that panels need.
function shownLayers() {
  if (document.hidden) return ["delivery"];
  if (kiosk?.on) return ["labels", "delivery"];
  const switched = SWITCHES.map(([layer]) => layer).filter((layer) => !hidden.has(layer));
  return [...new Set([
    ...NEEDED, ...switched, ...(cameraInView ? ["camera"] : []), ...(solid?.on ? SOLID_LAYERS : []),
    ...(inspect?.layers ?? []),
  ])];
}

function send(command) {
  const sent = link.send(command);
  if (!sent) showNotice(tr("Not connected: the command was not sent."));
  return sent;
}

kiosk = new Kiosk(send, () => link.show());

function gesture(command) {
  if (command.do === "measure") return true;             // it was shown during the drag
  if (command.do === "place" || command.do === "corner") {
    const taken = mapEdit.pressed(command);
    if (command.do === "place" && cursor.pose) $("place-label").focus();   // by keyboard the form is far away
    return taken;
  }
  return command.do === "goal" ? panels.round.go(command, tr("this point")) : send(command);
}

// A drag of a tool that draws; without points it has ended.
function draw(tool, points) {
  if (points) mapEdit.drawing.dragged(tool, points);
  else mapEdit.drawing.released();
}

function paint(context) {
  if (!complete) return;
  glides.advance();
  const robot = shown.get("robot");
  if (following && robot) view.track(robot);
  view.labels = new Labels(context, view, (x, y) => roomTint(view.metres(x, y)));
  for (const [layer, painter] of PAINTERS) {
    const value = shown.get(layer) ?? data.get(layer);
    if (value && !hidden.has(layer)) painter(context, view, value, data);
  }
  mapEdit.paint(context, view);
  cursor.paint(context, view);
  if (tools.drag && tools.view === view && tools.tool.id === "measure") ruler(context, view, tools.drag);
  else if (tools.drag && tools.view === view && !tools.tool.draws) arrow(context, view, tools.pose(), COLOURS.goal(), Math.max(34, 0.7 * view.scale));
  scaleBar(context, view, viewsBelow ? 62 : 18);
  const moving = data.get("path") && !hidden.has("path") && !STILL.matches;
  if (!solid.on && (moving || !glides.done)) view.refresh();
}

// The robot is received ten times a second and drawn at every frame in between.
function glide(layer, pose) {
  const from = shown.get(layer);
  if (!pose || !from || Math.hypot(pose.x - from.x, pose.y - from.y) > JUMP) {
    shown.set(layer, pose);
    return;
  }
  const turn = Math.atan2(Math.sin(pose.yaw - from.yaw), Math.cos(pose.yaw - from.yaw));
  glides.to(layer, (share) => shown.set(layer, {
    ...pose, x: from.x + share * (pose.x - from.x), y: from.y + share * (pose.y - from.y), yaw: from.yaw + share * turn,
  }));
}

function showFirstPicture() {
  if (complete) return;
  complete = true;
  refresh();
}

function refresh() {
  view.refresh();
  solid.view?.refresh();
}

function lookAway() {
  whole = false;
  follow(false);
}

function follow(on) {
  following = on;
  $("follow").setAttribute("aria-pressed", String(on));
  solid.view?.follow(on);
  const robot = data.get("robot");
  if (on && robot) view.track(robot);
  view.refresh();
}

function fit() {
  const grid = data.get("map");
  if (!grid) { solid.view?.home(); return; }
  whole = true;
  follow(false);
  if (solid.on) solid.view?.fit(knownArea(grid));
  showWhole();
}

function resized(inPlace) {
  viewsBelow = $("views").offsetTop > view.height / 2;
  if (whole) showWhole(inPlace);
}

// Keep the known map in view while it grows and the page is resized, until the operator pans.
// A map that is `inPlace` stays as it is while it can be seen.
function showWhole(inPlace = false) {
  const grid = data.get("map");
  if (!grid || !view.width || !view.height) return;
  const bar = $("tools").offsetHeight + 16, covered = [bar, viewsBelow ? bar + 24 : 30], area = knownArea(grid);
  if (!inPlace || !view.shows(area, ...covered)) view.fit(area, ...covered);
}

// The sentence about the place of the robot has become old.
function forgetWhere() { $("where-text").textContent = ""; }

// Report a failed goal on every tab.
function showFailure(status) {
  const count = status?.failures ?? 0;
  if (failures !== null && count > failures && status.reason) {
    showNotice(translated(status.reason), { urgent: true });
    alerts.give(translated(status.reason), "failure");
  }
  failures = count;
}

// Report on every tab what the deliveries have refused, such as a change of a round that has changed.
function showRefusal(status) {
  const count = status?.notices ?? 0;
  if (refusals !== null && count > refusals && status.notice) showNotice(translated(status.notice));
  refusals = count;
}

const HANDLERS = {
  stop: (value) => { stop.take(value); kiosk.stop(value); panels.round.stop(value); forgetWhere(); },
  map: (value) => { if (value && whole) { follow(false); showWhole(); } },
  robot: (value) => { panels.robot(value); if (following) follow(true); },
  status: (value) => { panels.status(value); inspect.transforms.status(value); incidents.status(value); alerts.status(value); showFailure(value); showRefusal(value); tools.showSimulationTools(Boolean(value?.simulation)); },
  labels: (value) => { setLabels(value ?? {}); mapEdit.labels = value ?? {}; panels.relabel(data.get("places") ?? []); kiosk.show(data.get("delivery")); mapEdit.showPlaces(data.get("places") ?? []); },
  places: (value) => { panels.places(value ?? []); mapEdit.showPlaces(value ?? []); },
  zones: (value) => mapEdit.showZones(value),
  mapping: (value) => mapEdit.showMapping(value),
  launch: (value) => { document.body.classList.toggle("mapping", Boolean(value?.mapping)); mapEdit.showLaunch(value); },
  edits: (value) => mapEdit.answers(value),
  graph: (value) => inspect.showGraph(value),
  values: (value) => inspect.showValues(value ?? []),
  parameters: (value) => inspect.parameters.show(value ?? []),
  log: (value) => inspect.log.show(value ?? []),
  cell: (value) => { if (value) tools.answer("inspect_cell", cellSentence(value)); },
  frames: (value) => inspect.transforms.showMoving(value ?? []),
  fixed_frames: (value) => inspect.transforms.showFixed(value ?? []),
  delivery: (value) => { panels.delivery(value); mapEdit.mapping.delivery(value); kiosk.show(value); alerts.delivery(value); reportLostRound(value); forgetWhere(); },
  forecast: (value) => panels.round.showForecast(value ?? []),
  history: (value) => panels.round.showHistory(value ?? []),
  progress: (value) => panels.progress(value),
  incidents: (value) => { if (value) incidents.show(value); },
  playback: (value) => playback.show(value),
  causes: (value) => panels.causes(value ?? []),
  camera: (value) => panels.camera(value),
};

const DRAWN = new Set([...PAINTERS.map(([layer]) => layer), "shape", "delivery"]);

function take(layer, value) {
  lastData = performance.now();
  data.set(layer, value);
  if (layer === "map") showFirstPicture();
  HANDLERS[layer]?.(value);
  if (layer === "robot" || layer === "truth") glide(layer, value);
  solid.take(layer, value);
  if (DRAWN.has(layer) && !hidden.has(layer)) view.refresh();
}

// A server that was restarted may know nothing of what the page still shows.
function forget() {
  unserved ||= panels.round.unserved();   // it may restart again before it knows of a round
  for (const layer of data.keys()) if (!OF_THE_ROBOT.has(layer)) take(layer, null);
}

// If only the web UI's process was restarted, the robot still has the round.
function reportLostRound(delivery) {
  if (!unserved || !delivery) return;
  if (!delivery.round_active && !delivery.orders.length) {
    showNotice(lasting = tr("chefbot was restarted and lost the round. Not served: {places}.", { places: unserved }), { stays: true, urgent: true });
  }
  unserved = "";
}

link.addEventListener("layer", ({ detail: { layer, value } }) => take(layer, value));
link.addEventListener("greeted", ({ detail: { arrived, restarted, role, hasMap } }) => {
  if (!hasMap) showFirstPicture();
  showRole(role);
  if (arrived) {
    showNotice(tr("Reconnected. The robot received the last command."));
    panels.orderArrived();
  }
  panels.round.connected();
  if (restarted) forget();
});
link.addEventListener("up", () => {
  document.body.classList.remove("offline");
  $("panels").inert = false;
  link.show();
  lastData = performance.now();
  stop.connected();
  kiosk.connected(data.get("delivery"));
  solid.reload();
  if (!keepNotice) showNotice(lasting || loadError, { stays: Boolean(lasting) });
  keepNotice = false;
});
link.addEventListener("down", ({ detail: lost }) => {
  document.body.classList.add("offline");
  driver.release();
  kiosk.lost();
  $("phase").textContent = tr("No connection to the robot.");
  if (lost.length) {
    keepNotice = true;
    panels.keepOrder();
    showNotice(tr("Connection lost before the robot confirmed the last command. Check the robot and repeat the command if necessary."), { stays: true, urgent: true });
  } else if (!keepNotice) {
    const expected = data.get("launch")?.ends;
    showNotice(expected ? tr("The robot's programs start again …") : tr("Connection lost. The robot stops if it was being driven by hand. Reconnecting …"), { stays: true, urgent: !expected });
  }
});
link.addEventListener("locked", ({ detail }) => {
  keepNotice = true;
  kiosk.lock(detail);
  stop.unknown();
  $("panels").inert = true;              // what it shows is old, and commands would be lost
  showNotice(translated(detail), { stays: true, urgent: true });
  $("notice-close").hidden = true;
});
link.addEventListener("age", ({ detail }) => {
  $("age").hidden = !link.open || detail < OLD;
  $("age").textContent = tr("This view is {seconds} s old.", { seconds: (detail / 1000).toFixed(1) });
});
link.addEventListener("refused", ({ detail }) => { panels.keepOrder(); kiosk.refused(detail); mapEdit.refused(translated(detail)); showNotice(translated(detail)); });
link.addEventListener("done", ({ detail }) => kiosk.done(detail));

// What is urgent interrupts a screen reader; other news wait until it has ended its sentence.
function showNotice(sentence, { stays = false, urgent = false } = {}) {
  clearTimeout(refusal);
  $("notice-close").hidden = !sentence;
  $("notice").ariaLive = urgent ? "assertive" : "polite";
  $("notice").textContent = sentence;
  $("notice").hidden = !sentence;
  if (sentence && !stays) refusal = setTimeout(() => { if (link.open) showNotice(""); }, 6000);
}

setInterval(() => {
  const silent = performance.now() - lastData, stale = link.open && data.size > 0 && silent > STALE && !data.get("playback");
  document.body.classList.toggle("stale", stale);
  if (stale) $("phase").textContent = tr("No data from the robot for {seconds} s.", { seconds: Math.round(silent / 1000) });
}, 500);

for (const [layer, label] of SWITCHES) {
  const row = document.createElement("label"), box = document.createElement("input"), colour = document.createElement("i");
  box.type = "checkbox";
  box.checked = !hidden.has(layer);
  box.dataset.layer = layer;
  box.onchange = () => {
    if (box.checked) hidden.delete(layer); else hidden.add(layer);
    link.show();
    refresh();
  };
  colour.style.background = COLOURS[layer]();
  row.append(box, label, colour);
  $("layer-list").append(row);
}
new IntersectionObserver(([{ isIntersecting }]) => {
  if (isIntersecting === cameraInView) return;
  cameraInView = isIntersecting;
  link.show();
}).observe($("camera").parentElement);
document.addEventListener("visibilitychange", () => link.show());
$("canvas").addEventListener("pointermove", (event) => {
  const { x, y } = view.metres(...view.at(event));
  $("cursor").textContent = `x ${x.toFixed(2)} m, y ${y.toFixed(2)} m`;
});
$("canvas").addEventListener("pointerleave", () => { $("cursor").textContent = ""; });
$("canvas").addEventListener("wheel", () => { whole = false; });
$("follow").onclick = () => {
  whole = false;
  follow(!following);
  if (following) solid.view?.home();
};
$("fit").onclick = fit;
$("language").replaceChildren(...Object.entries(LANGUAGES).map(([code, name]) => new Option(name, code, false, code === language)));
$("language").onchange = () => {
  if (choose($("language").value)) return;
  $("language").value = language;
  showNotice(tr("This browser cannot store settings, so the web UI follows the browser's language."));
};
if (loadError) showNotice(loadError, { stays: true });
$("notice-close").onclick = () => showNotice(lasting = "");
setTimeout(showFirstPicture, MAP_PATIENCE);
$("where").onclick = () => {
  clearTimeout(whereAsked);
  $("where-text").textContent = whereSentence(data);
  whereAsked = setTimeout(forgetWhere, WHERE_SHOWN);   // soon it is somewhere else
};
window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { refresh(); solid.view?.repaint(data); });

// What is shown, as far as it is not as usual, in the address.
function shownView() {
  const { x, y } = view.centre, boxes = inspect.boxes.filter((id) => id !== "inspect-box");
  const moved = !whole && !following, switched = SWITCHES.map(([layer]) => layer).filter((layer) => hidden.has(layer) !== QUIET.includes(layer));
  const text = (list) => list.join(",") || null;
  return {
    "3d": solid.on ? "" : null, tab: panels.tab === "serve" || panels.tab === "model-panel" ? null : panels.tab,
    x: moved ? x.toFixed(2) : null, y: moved ? y.toFixed(2) : null, scale: moved ? view.scale.toFixed(1) : null, follow: following && !whole ? "" : null,
    layers: text(switched), topics: text(inspect.watched), curves: text(inspect.curves.chosen), open: text(boxes), node: inspect.parameters.node || null,
  };
}

function showView(wanted) {
  const list = (name) => (wanted.get(name) ?? "").split(",").filter(Boolean);
  solid.turn(wanted.has("3d"));
  if (wanted.has("tab") && $(wanted.get("tab"))?.matches(".panel")) { panels.open(wanted.get("tab")); $(wanted.get("tab")).scrollIntoView(); }
  const [x, y, scale] = ["x", "y", "scale"].map((name) => Number(wanted.get(name) ?? NaN));
  if ([x, y, scale].every(Number.isFinite)) { lookAway(); view.look(x, y, scale); }
  if (wanted.has("follow")) { whole = false; follow(true); }
  for (const box of document.querySelectorAll("#layer-list input")) {
    const on = list("layers").includes(box.dataset.layer) === QUIET.includes(box.dataset.layer);
    if (box.checked !== on) box.click();
  }
  for (const id of list("open")) if ($(id)?.matches("#inspect details")) $(id).open = true;
  inspect.restore(list("topics"), list("curves"), wanted.get("node") ?? "");
}
address = new ViewAddress(shownView, showView);
keepOnDevice().catch((error) => console.warn(`not kept on this device: ${error.message}`));
