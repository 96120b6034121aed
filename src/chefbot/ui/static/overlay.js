// A panel over the map that a button opens and closes, and the focus with it.
export class Overlay {
  constructor(name, changed = () => {}) {
    const $ = (part) => document.getElementById(part);
    Object.assign(this, { box: $(name), opener: $(`${name}-open`), closer: $(`${name}-close`), changed });
    this.opener.onclick = () => this.turn(this.box.hidden);
    this.closer.onclick = () => this.turn(false);
  }

  get open() { return !this.box.hidden; }

  turn(on) {
    this.box.hidden = !on;
    this.opener.setAttribute("aria-pressed", String(on));
    this.changed();
    (on ? this.closer : this.opener).focus();
  }
}
