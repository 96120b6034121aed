// Mapping from the web UI: exploration, an empty map, and saving under a name.
import { tr, translated } from "./language.js";

const $ = (id) => document.getElementById(id);

export class Mapping {
  constructor(send) {
    this.send = send;
    this.exploring = false;
    this.saved = "";                     // the name of the last request to save
    this.saving = "";                    // id of the request that has not ended
    this.onMap = "";                     // the name of the map that was saved last
    this.launch = null;                  // the launch that runs; null if it cannot be replaced
    this.roundActive = false;
    this.continued = false;
    $("explore").onclick = () => send({ do: "explore", on: !this.exploring });
    $("reset-map").onclick = () => this.confirm($("reset-map-sure").hidden ? "reset-map-sure" : "");
    $("reset-map-sure").onclick = () => { send({ do: "reset_map" }); this.confirm(""); };
    $("save-map-form").onsubmit = (event) => { event.preventDefault(); this.save(false); };
    $("replace-map").onclick = () => this.save(true);
    $("drive-on-map").onclick = () => this.confirm("drive-on-map-sure");
    $("drive-on-map-sure").onclick = () => { send({ do: "drive_on_map", name: this.onMap }); this.confirm(""); };
    $("map-building").onclick = () => this.askToMap(false);
    $("continue-map").onclick = () => this.askToMap(true);
    $("map-sure").onclick = () => { send({ do: "map_building", continued: this.continued }); this.confirm(""); };
    $("map-name").oninput = () => { this.confirm(""); $("mapping-note").textContent = ""; };
  }

  // What would lose a map needs a second press.
  confirm(id) {
    for (const one of ["reset-map-sure", "replace-map", "map-sure", "drive-on-map-sure"]) $(one).hidden = one !== id;
    if (id) $(id).scrollIntoView({ block: "nearest" });
  }

  save(replace) {
    const name = $("map-name").value.trim();
    this.confirm("");
    this.saved = name;
    this.saving = `${Date.now()}-${Math.random().toString(36).slice(2)}`;
    if (this.send({ do: "save_map", name, replace, id: this.saving })) $("mapping-note").textContent = tr("Saving …");
  }

  // Another launch ends deliveries, so it needs a second press, and no round.
  askToMap(continued) {
    this.continued = continued;
    $("launch-note").textContent = this.roundActive ? tr("A delivery round is active; end it first.") : "";
    this.confirm(this.roundActive ? "" : "map-sure");
  }

  delivery(view) {
    this.roundActive = Boolean(view?.round_active);
    if (this.roundActive && !$("map-sure").hidden) this.askToMap(this.continued);
  }

  showLaunch(view) {
    if (this.launch?.ends && !view?.ends) $("mapping-note").textContent = $("launch-note").textContent = "";   // the other launch runs
    this.launch = view;
    $("launch-box").hidden = !view || view.mapping;
    $("continue-map").hidden = !view?.can_continue;
    const note = view?.ends ? tr("The robot's programs start again …") : translated(view?.notice ?? "");
    if (note) $(view.mapping ? "mapping-note" : "launch-note").textContent = note;
    this.offerSaved();
  }

  offerSaved() {
    $("drive-on-map").hidden = !this.launch?.mapping || !this.onMap;
    $("drive-on-map").textContent = tr("End mapping and use the map {name}", { name: this.onMap });
  }

  show(view) {
    $("mapping-box").hidden = !view;
    if (!view) return;
    this.exploring = view.exploring;
    $("explore").setAttribute("aria-pressed", String(view.exploring));
    $("explore").textContent = view.exploring ? tr("End the exploration") : tr("Explore");
    $("exploration").textContent = translated(view.description);
    $("mapper").textContent = translated(view.mapper);
    $("mapper").hidden = !view.mapper;
    const ended = this.saving && view.outcomes.find(({ id }) => id === this.saving);
    if (ended) {
      this.saving = "";
      $("mapping-note").textContent = translated(ended.sentence);
      if (ended.sentence.includes(`called ${this.saved} already`)) this.confirm("replace-map");
    }
    this.onMap = view.saved;
    this.offerSaved();
  }
}
