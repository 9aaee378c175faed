/** One place that holds the state of the page, and tells those who asked what has changed. */

/** @typedef {import("./types.js").State} State */

export class Store {
  /** @param {State} state */
  constructor(state) {
    this.state = state;
    /** @type {{keys: Set<string>, tell: (changed: Set<string>) => void}[]} */
    this.listeners = [];
  }

  /** Tell `tell` whenever one of the keys changes. @param {(keyof State)[]} keys @param {(changed: Set<string>) => void} tell */
  on(keys, tell) {
    this.listeners.push({ keys: new Set(keys), tell });
  }

  /** Change some of the state. Values are replaced, never altered in place. @param {Partial<State>} part */
  set(part) {
    const changed = new Set(
      Object.keys(part).filter((key) => /** @type {any} */ (part)[key] !== /** @type {any} */ (this.state)[key]),
    );
    if (!changed.size) return;
    this.state = { ...this.state, ...part };
    for (const { keys, tell } of this.listeners) if ([...changed].some((key) => keys.has(key))) tell(changed);
  }
}

/** Work that is done once before the next picture, however often it is asked for. */
export class Frame {
  constructor() {
    /** @type {Map<string, () => void>} */
    this.waiting = new Map();
    this.asked = false;
  }

  /** Do `work` before the next picture; a later one of the same name takes its place. @param {string} name @param {() => void} work */
  before(name, work) {
    this.waiting.set(name, work);
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(() => {
      this.asked = false;
      const all = [...this.waiting.values()];
      this.waiting.clear();
      for (const each of all) each();
    });
  }
}
