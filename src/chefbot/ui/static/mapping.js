// Mapping from the web UI: exploration, an empty map, and saving under a name.
import { tr, translated } from "./language.js";

const $ = (id) => document.getElementById(id);

export class Mapping {
  constructor(send) {
    this.send = send;
    this.exploring = false;
    this.saved = "";                     // the name of the last request to save
    this.requests = null;                // number of requests that have ended; null before the first view
    $("explore").onclick = () => send({ do: "explore", on: !this.exploring });
    $("reset-map").onclick = () => this.confirm($("reset-map-sure").hidden ? "reset-map-sure" : "");
    $("reset-map-sure").onclick = () => { send({ do: "reset_map" }); this.confirm(""); };
    $("save-map-form").onsubmit = (event) => { event.preventDefault(); this.save(false); };
    $("replace-map").onclick = () => this.save(true);
    $("map-name").oninput = () => { this.confirm(""); $("mapping-note").textContent = ""; };
  }

  // What would lose a map needs a second press.
  confirm(id) { for (const one of ["reset-map-sure", "replace-map"]) $(one).hidden = one !== id; }

  save(replace) {
    const name = $("map-name").value.trim();
    this.confirm("");
    this.saved = name;
    if (this.send({ do: "save_map", name, replace })) $("mapping-note").textContent = tr("Saving …");
  }

  show(view) {
    $("mapping-box").hidden = !view;
    if (!view) return;
    this.exploring = view.exploring;
    $("explore").setAttribute("aria-pressed", String(view.exploring));
    $("explore").textContent = view.exploring ? tr("End the exploration") : tr("Explore");
    $("exploration").textContent = translated(view.description);
    if (this.requests !== null && view.requests !== this.requests) {
      $("mapping-note").textContent = translated(view.outcome);
      if (view.outcome.includes(`called ${this.saved} already`)) this.confirm("replace-map");
    }
    this.requests = view.requests;
  }
}
