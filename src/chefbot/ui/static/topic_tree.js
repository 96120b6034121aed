// Topics as a tree of their namespaces, each with its types and its rate.

const SHOWN = 200;                       // topics listed at once
const RARE = 0.5;                        // Hz: rates of fewer messages are not measured, unless a topic is watched

export class TopicTree {
  // `toggle(name)` watches a topic, or watches it no longer.
  constructor(list, toggle) {
    Object.assign(this, { list, toggle });
    this.closed = new Set();             // namespaces
    this.buttons = new Map();            // by topic
    this.shape = "";
  }

  // The elements stay while the topics do, so that the focus stays on one.
  show(topics, watched) {
    const listed = topics.slice(0, SHOWN), shape = JSON.stringify(listed.map(({ name, types }) => [name, types]));
    if (shape !== this.shape) {
      this.shape = shape;
      this.buttons.clear();
      this.list.replaceChildren(...this.branches(namespaceTree(listed), ""));
    }
    for (const topic of listed) this.mark(topic, watched);
  }

  mark({ name, publishers, subscriptions, hz }, watched) {
    const { button, rate } = this.buttons.get(name), isWatched = watched.includes(name);
    button.setAttribute("aria-pressed", String(isWatched));
    button.title = `${publishers.join(", ")} → ${subscriptions.join(", ")}`;
    if (isWatched) return;
    rate.textContent = hz === null ? "" : hz < RARE ? ` < ${RARE} Hz` : ` ${hz.toFixed(1)} Hz`;
  }

  showRate(name, hz) {
    const known = this.buttons.get(name);
    if (known) known.rate.textContent = ` ${hz.toFixed(1)} Hz`;
  }

  branches(tree, path) {
    return [...tree.inner].map(([part, inner]) => (inner.count > 1 ? this.branch(part, inner, path) : this.leaf(onlyTopic(inner), path)))
      .concat(tree.topics.map((topic) => this.leaf(topic, path)));
  }

  branch(part, tree, path) {
    const item = document.createElement("li"), box = document.createElement("details"), head = document.createElement("summary");
    const list = document.createElement("ul"), here = `${path}/${part}`;
    head.textContent = `/${part}`;
    box.open = !this.closed.has(here);
    box.ontoggle = () => { if (box.open) this.closed.delete(here); else this.closed.add(here); };
    list.append(...this.branches(tree, here));
    box.append(head, list);
    item.append(box);
    return item;
  }

  leaf(topic, path) {
    const item = document.createElement("li"), button = document.createElement("button");
    const kind = document.createElement("small"), rate = document.createElement("small");
    button.textContent = topic.name.slice(path.length);
    button.dataset.topic = topic.name;
    button.ariaLabel = `${topic.name} ${topic.types.join(", ")}`;
    button.onclick = () => this.toggle(topic.name);
    kind.textContent = ` ${topic.types.join(", ")}`;
    button.append(kind, rate);
    item.append(button);
    this.buttons.set(topic.name, { button, rate });
    return item;
  }
}

// { inner: trees by the next part of the namespace, topics: those without one, count: of all topics }
function namespaceTree(topics) {
  const root = emptyTree();
  for (const topic of topics) {
    const namespaces = topic.name.split("/").slice(1, -1);
    let tree = root;
    for (const part of namespaces) {
      if (!tree.inner.has(part)) tree.inner.set(part, emptyTree());
      tree = tree.inner.get(part);
      tree.count += 1;
    }
    tree.topics.push(topic);
  }
  return root;
}

const emptyTree = () => ({ inner: new Map(), topics: [], count: 0 });
const onlyTopic = ({ inner, topics }) => topics[0] ?? onlyTopic([...inner.values()][0]);
