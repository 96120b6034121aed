// Switches between the map from above and the 3-D view. The 3-D library is loaded at the first use.
import { tr } from "./language.js";

const $ = (id) => document.getElementById(id);
const HINT = tr("Drag to turn, right button or two fingers to move, wheel or pinch to zoom, click a part.");

export class Solid {
  constructor({ data, hidden, following, turned, tools, showNotice }) {
    Object.assign(this, { data, hidden, following, turned, tools, showNotice });
    this.view = null;
    this.on = false;
    $("solid").onclick = () => this.turn(!this.on);
  }

  async turn(on) {
    if (on === this.on) return;
    this.on = on;
    this.tools.choose("look");           // a drag that was begun in the other view ends
    document.body.classList.toggle("solid", on);
    $("solid").setAttribute("aria-pressed", String(on));
    $("canvas").hidden = on;
    $("model").hidden = $("model-names").hidden = $("model-panel").hidden = $("model-tab").hidden = !on;
    $("model-hint").textContent = on ? HINT : "";
    this.turned(on);
    if (on && !this.loading) await (this.loading = this.load());
    if (on) this.catchUp();
  }

  async load() {
    try {
      const { ModelView } = await import("./model/view.js");
      this.view = new ModelView($("model"), $("model-names"), this.hidden);
    } catch (error) {
      this.loading = null;
      await this.turn(false);
      return this.showNotice(tr("This browser cannot show the robot in 3-D: {error}", { error: error.message }));
    }
    globalThis.modelView = this.view;    // for the browser's console
    this.tools.watch(this.view.floor((floor) => (this.tools.drag && this.tools.view === floor ? this.tools.pose() : null)));
    this.tools.choose(this.tools.tool.id);
    this.view.follow(this.following());
    this.catchUp();
    await this.view.load("robot.glb");
  }

  // After a reconnection another server may answer: the one that shows the progress of compilation has no robot model.
  reload() { this.view?.load("robot.glb"); }

  take(layer, value) { if (this.on) this.view?.take(layer, value); }

  // Apply the layers received while the map was shown.
  catchUp() { for (const [layer, value] of this.data) this.view?.take(layer, value); }
}
