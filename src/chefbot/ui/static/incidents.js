// The last minute, saved as a file: by a button, and the list of those that were saved.
import { language, tr, translated } from "./language.js";

const $ = (id) => document.getElementById(id);

export class Incidents {
  constructor(send) {
    $("save-incident").onclick = () => {
      if (!send({ do: "save_incident", note: $("incident-note").value })) return;
      $("incident-note").value = "";
      $("incident-saved").textContent = tr("Saving the last minute …");
    };
    $("record").onclick = () => {
      if (send({ do: "record", on: this.since === null, note: $("incident-note").value })) $("incident-note").value = "";
    };
    this.since = null;                   // when the recording began that is under way, seconds on the robot's clock
    this.requests = null;                // number of requests that have ended; null before the first list
  }

  // The length of the recording that is under way.
  status(status) {
    if (this.since !== null && status?.clock) $("incident-saved").textContent = tr("Recording for {seconds} s", { seconds: Math.max(0, Math.round(status.clock - this.since)) }) + this.by;
  }

  // The newest first, each a link to its file; above, how the last request ended.
  show({ saved: list, outcome, requests, recording_since: since, recorded_by: by }) {
    this.since = since ?? null;
    this.by = by ? ` (${by})` : "";
    $("record").setAttribute("aria-pressed", String(this.since !== null));
    $("record").textContent = this.since === null ? tr("Record") : tr("End the recording");
    if (this.requests !== null && requests !== this.requests) $("incident-saved").textContent = translated(outcome);
    this.requests = requests;
    $("incidents-box").hidden = !list.length;
    $("incidents").replaceChildren(...list.map(({ name, size, incident }) => {
      const item = document.createElement("li"), link = document.createElement("a");
      link.href = `incidents/${encodeURIComponent(name)}`;
      link.download = name;
      link.textContent = new Date(incident.time).toLocaleString(language, { dateStyle: "short", timeStyle: "short" });
      const by = incident.by ? ` (${incident.by})` : "";
      item.append(link, `, ${(size / 1e6).toFixed(1)} MB${by}: ${translated(incident.sentence) || tr("no reason given")}`);
      return item;
    }));
  }
}
