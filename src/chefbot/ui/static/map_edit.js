// Places and zones of the map, changed by pressing on it: a form for the one that is selected, and the robot's answer.
import { COLOURS } from "./colours.js";
import { title, tr, translated, translatedAsWritten } from "./language.js";
import { arrow } from "./layers.js";
import { MapDrawing } from "./map_drawing.js";
import { Mapping } from "./mapping.js";

const $ = (id) => document.getElementById(id);
const PREVIEW_DELAY = 400;               // milliseconds without a change before the robot previews it
const ANSWER_TIME = 15000;               // milliseconds for the robot's answer
const DEGREE = Math.PI / 180;
const SLOWEST = 0.1, FASTEST = 10;       // m/s, limits of a slow zone

export class MapEdit {
  // `choose(tool)` selects a tool of the map; `robot()` is where the robot is; `changed()` draws the map again.
  constructor(send, choose, robot, changed) {
    Object.assign(this, { send, choose, robot, changed });
    this.places = this.zones = [];
    this.place = this.zone = null;       // what is being changed; a new one has no name
    this.saving = this.previewing = "";  // ids of requests whose answers are expected
    this.newest = this.seen = "";        // id of the last change of the map, and of the last when a form was opened
    this.shown = { zones: false, mapping: false, launch: false };
    this.mapping = new Mapping(send);
    this.drawing = new MapDrawing((command) => this.request(command), choose, changed, () => this.opening());
    this.wire();
  }

  wire() {
    $("place-new").onclick = ({ detail: clicks }) => {
      this.startPlace();
      if (!clicks) $("canvas").focus();                                    // a key, as the map is far away
    };
    $("place-here").onclick = () => { if (this.robot()) this.openPlace({ ...this.robot(), name: "" }); };
    $("place-move").onclick = () => this.choose("place");
    $("place-delete").onclick = () => this.save({ do: "delete_place", name: this.place.name });
    $("place-cancel").onclick = $("zone-cancel").onclick = () => this.close();
    $("place-form").onsubmit = (event) => { event.preventDefault(); this.savePlace(); };
    $("zone-new").onclick = () => this.openZone({ name: "", kind: "keep_out", corners: [], speed: 0.15, direction: 0 });
    $("zone-back").onclick = () => { this.zone.corners.pop(); this.cornersChanged(); };
    $("zone-delete").onclick = () => this.save({ do: "delete_zone", name: this.zone.name });
    $("zone-form").onsubmit = (event) => { event.preventDefault(); this.save(this.zoneCommand()); };
    for (const id of ["zone-kind", "zone-speed", "zone-direction"]) $(id).oninput = () => this.fieldsChanged();
    $("undo-edit").onclick = () => this.undo();
  }

  showPlaces(list) {
    this.places = list;
    const button = (place) => this.item(title(place.name), () => this.openPlace({ ...place }));
    $("place-list").replaceChildren(...list.map(button));
    this.noteRemoval(this.place, list);
  }

  // The map server publishes zones, perhaps none; without it, as while mapping, there is no map to change.
  showZones(list) {
    $("edit-box").hidden = !list;
    this.shown.zones = Boolean(list);
    this.offer();
    this.zones = list ?? [];
    const button = (zone) => this.item(title(zone.title), () => this.openZone({ ...zone, corners: zone.corners.map((corner) => [...corner]) }));
    $("zone-list").replaceChildren(...this.zones.map(button));
    this.noteRemoval(this.zone, this.zones);
  }

  // Another person has removed what this one is changing.
  noteRemoval(edited, list) {
    if (edited?.name && !this.saving && !list.some(({ name }) => name === edited.name)) this.note(tr("{name} was removed in the meantime; saving adds it again.", { name: title(edited.title ?? edited.name) }));
  }

  showMapping(view) {
    this.mapping.show(view);
    this.shown.mapping = Boolean(view);
    this.offer();
  }

  showLaunch(view) {
    this.mapping.showLaunch(view);
    this.shown.launch = Boolean(view);
    this.offer();
  }

  // Without a map server and without an explorer there is nothing to change.
  offer() { $("edit-map").hidden = $("edit-tab").hidden = !this.shown.zones && !this.shown.mapping && !this.shown.launch; }

  item(text, action) {
    const item = document.createElement("li"), button = document.createElement("button");
    button.textContent = text;
    button.onclick = action;
    item.append(button);
    return item;
  }

  startPlace() {
    this.close();
    this.choose("place");
  }

  // The operator has pressed a pose on the map.
  pressed({ do: tool, x, y, yaw, dragged }) {
    if (tool === "corner") {
      if (this.zone.corners.length === this.zone.from) this.zone.corners = this.zone.from ? [] : this.zone.corners;
      this.zone.from = -1;
      this.zone.corners.push([x, y]);
      this.cornersChanged();
    } else if (this.place) Object.assign(this.place, { x, y, moved: true, ...(dragged ? { yaw } : {}) });
    else this.openPlace({ name: "", x, y, yaw });
    this.changed();
  }

  // Close other forms; what another person changes from now on is not overwritten.
  opening() {
    this.close();
    this.seen = this.newest;
  }

  openPlace(place) {
    this.opening();
    this.place = place;
    $("edit-note").textContent = "";
    $("place-form").hidden = false;
    $("place-kind").parentElement.hidden = Boolean(place.name);
    $("place-delete").hidden = !place.name;
    $("place-label").value = place.name ? title(place.name) : "";
    this.changed();
    $("place-form").scrollIntoView({ block: "nearest" });   // its buttons, too, on a phone
  }

  savePlace() {
    const { name, x, y, yaw, moved } = this.place, label = $("place-label").value.trim();
    const plain = name && label === title(name) && !this.hasLabel(name);    // the name itself is no label
    this.save({ do: "put_place", name, x, y, yaw, moved: Boolean(moved || !name), kind: $("place-kind").value, label: plain ? "" : label });
  }

  hasLabel(name) { return Object.hasOwn(this.labels ?? {}, name); }

  // Pressing a corner of a zone that exists replaces its old corners.
  openZone(zone) {
    this.opening();
    this.zone = { ...zone, from: zone.corners.length || -1 };
    $("edit-note").textContent = $("zone-effects").textContent = "";
    $("zone-form").hidden = false;
    $("zone-kind").value = zone.kind;
    $("zone-speed").value = zone.speed || 0.15;
    $("zone-direction").value = Math.round(zone.direction / DEGREE);
    $("zone-delete").hidden = !zone.name;
    this.choose("corner");
    this.fieldsChanged();
    $("zone-form").scrollIntoView({ block: "nearest" });
  }

  fieldsChanged() {
    const kind = $("zone-kind").value;
    $("zone-speed-row").hidden = kind !== "slow";
    $("zone-direction-row").hidden = kind !== "one_way";
    this.cornersChanged();
  }

  cornersChanged() {
    const few = this.zone.corners.length < 3, speed = Number($("zone-speed").value);
    const wrong = $("zone-kind").value === "slow" && !(speed >= SLOWEST && speed <= FASTEST);
    $("zone-save").disabled = few || wrong;
    $("zone-back").disabled = !this.zone.corners.length;
    $("zone-effects").textContent = few ? tr("A zone needs three or more corners.") : wrong ? tr("The limit of a slow zone is 0.1 to 10 m/s.") : "";
    clearTimeout(this.timer);
    if (!few && !wrong) this.timer = setTimeout(() => this.preview(), PREVIEW_DELAY);
    this.changed();
  }

  preview() {
    if (!this.zone) return;
    this.previewing = this.request({ ...this.zoneCommand(), preview: true });
  }

  zoneCommand() {
    const direction = Number($("zone-direction").value) * DEGREE;
    return {
      do: "put_zone", name: this.zone.name, kind: $("zone-kind").value, corners: this.zone.corners,
      speed: $("zone-kind").value === "slow" ? Number($("zone-speed").value) : SLOWEST, direction: Math.atan2(Math.sin(direction), Math.cos(direction)),
    };
  }

  save(command) {
    this.saving = this.request(command);
    if (this.saving) $("edit-note").textContent = tr("Saving …");
  }

  undo() {
    this.undoing = true;
    this.seen = this.newest;             // the change that the button names
    this.save({ do: "undo_map_edit" });
  }

  // Send a change with an id of its own, and return that; empty without a connection.
  request(command) {
    const id = `${Date.now()}-${Math.random().toString(36).slice(2)}`;
    if (!this.send({ ...command, id, seen_change: this.seen })) return "";
    setTimeout(() => this.unanswered(id), ANSWER_TIME);
    return id;
  }

  // What became of the last changes, the newest first, perhaps of other pages'.
  answers(results) {
    if (!results?.length) return;
    const [newest] = results, isNews = this.latest !== undefined && newest.id !== this.latest;
    const own = [this.saving, this.drawing.saving].includes(newest.id);
    this.latest = newest.id;
    this.newest = newest.last_id;
    this.showUndo(newest);
    for (const result of results) this.answer(result);
    if (isNews && newest.applied && !own) this.previewAgain();
  }

  // Another person's change may have cut off more.
  previewAgain() {
    if (this.zone) this.cornersChanged();
    if (this.drawing.open) this.drawing.show();
  }

  answer(result) {
    if (result.id && [this.saving, this.drawing.saving].includes(result.id)) this.seen = this.newest;
    this.drawing.answer(result);
    const text = translated(result.description);
    if (result.id && result.id === this.previewing) $("zone-effects").textContent = text || tr("No place is cut off.");
    if (!result.id || result.id !== this.saving) return;
    this.saving = "";
    if (result.applied) this.close();
    const done = this.undoing ? tr("Undone.") : tr("Saved.");
    const refusal = this.undoing ? tr("Not undone: {reason}", { reason: text }) : tr("Not saved: {reason}", { reason: text });
    this.note(result.applied ? `${done} ${text}` : refusal);
    this.undoing = false;
  }

  showUndo({ undoable, last_change: change, last_edited_by: person }) {
    $("undo-edit").disabled = !undoable;
    const values = { change: translatedAsWritten(change), person };   // places have the labels of that time
    $("undo-edit").textContent = !change ? tr("Undo the last change") : person ? tr("Undo: {change} ({person})", values) : tr("Undo: {change}", values);
  }

  refused(sentence) {
    this.drawing.refused(sentence);
    if (this.saving) this.note(sentence);
    this.saving = "";
    this.undoing = false;
  }

  // A result that was lost on its way must not look as if it came soon.
  unanswered(id) {
    this.drawing.unanswered(id);
    if (id === this.saving) this.refused(tr("No answer. Look at the map, and save again."));
  }

  // The note stands below the lists, often out of sight.
  note(sentence) {
    $("edit-note").textContent = sentence;
    $("edit-note").scrollIntoView({ block: "nearest" });
  }

  close() {
    this.place = this.zone = null;
    clearTimeout(this.timer);
    $("place-form").hidden = $("zone-form").hidden = true;
    if (this.drawing.open) this.drawing.close();
    this.choose("look");
    this.changed();
  }

  paint(context, view) {
    this.drawing.paint(context, view);
    if (this.place) arrow(context, view, this.place, COLOURS.places(), Math.max(34, 0.7 * view.scale));
    if (!this.zone) return;
    const corners = this.zone.corners.map(([x, y]) => view.px(x, y));
    context.save();
    context.strokeStyle = context.fillStyle = COLOURS.goal();
    context.lineWidth = 2;
    context.beginPath();
    for (const corner of corners) context.lineTo(...corner);
    context.closePath();
    context.stroke();
    for (const [x, y] of corners) context.fillRect(x - 4, y - 4, 8, 8);
    context.restore();
  }
}
