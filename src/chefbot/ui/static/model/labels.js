// Names over the picture, as text of the page: crisp at any zoom. Names that would lie on each other move apart.
const LINE = 15;                         // pixels

export class Labels {
  constructor(box) {
    this.box = box;
    this.spans = new Map();
  }

  // points: [{ key, text, kind, place }] with places in the world.
  draw(points, camera, width, height) {
    const shown = points.map((point) => ({ ...point, at: onScreen(point.place, camera, width, height) })).filter(({ at }) => at);
    shown.sort((a, b) => a.at.y - b.at.y);
    const taken = [];
    const seen = new Set();
    for (const one of shown) {
      const span = this.span(one);
      const wide = span.offsetWidth, x = one.at.x + 7;
      let y = one.at.y - LINE / 2;
      for (const other of taken) {
        const apart = x > other.x + other.wide || x + wide < other.x;
        if (!apart && y < other.y + LINE && y + LINE > other.y) y = other.y + LINE;
      }
      taken.push({ x, y, wide });
      taken.sort((a, b) => a.y - b.y);
      span.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
      seen.add(one.key);
    }
    for (const [key, span] of this.spans) if (!seen.has(key)) { span.remove(); this.spans.delete(key); }
  }

  span({ key, text, kind }) {
    let span = this.spans.get(key);
    if (!span) {
      span = document.createElement("span");
      span.className = kind;
      this.spans.set(key, span);
      this.box.append(span);
    }
    if (span.textContent !== text) span.textContent = text;
    return span;
  }
}

function onScreen(place, camera, width, height) {
  const at = place.clone().project(camera);
  if (at.z > 1 || Math.abs(at.x) > 1.05 || Math.abs(at.y) > 1.05) return null;
  return { x: (at.x + 1) / 2 * width, y: (1 - at.y) / 2 * height };
}
