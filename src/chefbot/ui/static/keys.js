// Arrow keys inside a group of radio buttons or tabs, as the ARIA practices describe it: focus and choice move together.

const STEPS = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 };

export function byArrows(box, selector) {
  box.addEventListener("keydown", (event) => {
    if (!(event.key in STEPS) || event.ctrlKey || event.metaKey || event.altKey) return;
    const all = [...box.querySelectorAll(selector)].filter((one) => !one.hidden);
    const next = all[(all.indexOf(event.target) + STEPS[event.key] + all.length) % all.length];
    event.preventDefault();
    next.click();
    next.focus();
  });
}
