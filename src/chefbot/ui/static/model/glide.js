// News of a place comes ten times a second, pictures sixty times: from one place to the next things glide.
const LONGEST = 160;                     // milliseconds; what is told more seldom jumps there late
const STILL = window.matchMedia("(prefers-reduced-motion: reduce)");

export class Glides {
  constructor() {
    this.under = new Map();              // key to { apply, start, time } of what is on its way
    this.told = new Map();               // key to when it was told last
  }

  get done() { return this.under.size === 0; }

  // `apply(share)` puts the thing between its old place (0) and its new one (1); the first time it is there at once.
  to(key, apply, now = performance.now()) {
    const time = STILL.matches ? 0 : Math.min(LONGEST, now - (this.told.get(key) ?? now));
    this.told.set(key, now);
    this.under.set(key, { apply, start: now, time });
    if (time <= 0) this.step(key, now);
  }

  advance(now = performance.now()) { for (const key of [...this.under.keys()]) this.step(key, now); }

  step(key, now) {
    const { apply, start, time } = this.under.get(key);
    const share = time > 0 ? Math.min(1, Math.max(0, (now - start) / time)) : 1;
    apply(share);
    if (share === 1) this.under.delete(key);
  }
}
