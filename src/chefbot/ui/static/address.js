// The view in the page's address, so that a link opens the same one: #3d&tab=inspect&x=1.20&y=3.40&scale=80&topics=/odom
const PERIOD = 500;                      // milliseconds between two looks at what is shown
const KIOSK = "#kiosk";
const PLAIN = [["%2F", "/"], ["%2C", ","], ["=&", "&"]];

export class ViewAddress {
  // `read()` returns what is shown as texts by name, null for what is as usual; `apply(parameters)` shows it.
  constructor(read, apply) {
    Object.assign(this, { read, apply });
    this.restore();
    window.addEventListener("hashchange", () => this.restore());
    setInterval(() => this.write(), PERIOD);
  }

  // `known`: the part of the address that agrees with what is shown; the kiosk leaves an empty one.
  restore() {
    this.known = location.hash === KIOSK ? "" : location.hash;
    if (location.hash !== KIOSK) this.apply(new URLSearchParams(location.hash.slice(1)));
  }

  write() {
    if (location.hash === KIOSK) this.known = "";
    else if (location.hash !== this.known) this.restore();    // another address, whose event is still to come
    else this.replace();
  }

  replace() {
    const shown = Object.entries(this.read()).filter(([, value]) => value !== null);
    const hash = shown.length ? `#${encoded(new URLSearchParams(shown))}` : "";
    if (hash !== location.hash) history.replaceState(null, "", hash || location.pathname);
    this.known = location.hash;
  }
}

const encoded = (parameters) => PLAIN.reduce((text, [code, plain]) => text.replaceAll(code, plain), `${parameters}&`).slice(0, -1);
