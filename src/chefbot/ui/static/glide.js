// Interpolates between poses received at 10 Hz, for display at 60 Hz.
const LONGEST = 160;                     // longest interpolation, milliseconds
const STILL = window.matchMedia("(prefers-reduced-motion: reduce)");

export class Glides {
  constructor() {
    this.active = new Map();              // key to { apply, start, time } of active interpolations
    this.updated = new Map();               // key to the time of the last update
  }

  get done() { return this.active.size === 0; }

  // `apply(share)` sets a pose between the old one (0) and the new one (1); the first pose is set at once.
  to(key, apply, now = performance.now()) {
    const time = STILL.matches ? 0 : Math.min(LONGEST, now - (this.updated.get(key) ?? now));
    this.updated.set(key, now);
    this.active.set(key, { apply, start: now, time });
    if (time <= 0) this.step(key, now);
  }

  advance(now = performance.now()) { for (const key of [...this.active.keys()]) this.step(key, now); }

  step(key, now) {
    const { apply, start, time } = this.active.get(key);
    const share = time > 0 ? Math.min(1, Math.max(0, (now - start) / time)) : 1;
    apply(share);
    if (share === 1) this.active.delete(key);
  }
}
