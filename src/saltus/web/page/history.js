/** What the reader has changed, step by step, so that it can be undone: a drag of a slider is one step. */

/** @typedef {import("./types.js").State} State */
/** @typedef {Pick<State, "values"|"start"|"periods">} Step */

const QUIET = 400; // milliseconds without a change after which the next one is a step of its own
const MOST_STEPS = 200;

export class History {
  /** @param {import("./store.js").Store} store @param {(step: Step) => void} restore @param {(any: boolean) => void} told */
  constructor(store, restore, told) {
    this.store = store;
    this.restore = restore;
    this.told = told;
    /** @type {Step[]} */
    this.past = [];
    this.now = stepOf(store.state);
    this.restoring = false;
    /** @type {ReturnType<typeof setTimeout>|undefined} */
    this.changing = undefined;
    store.on(["values", "start", "periods"], () => this.changed());
  }

  changed() {
    if (this.restoring) return;
    if (this.changing === undefined) this.past = [...this.past, this.now].slice(-MOST_STEPS);
    clearTimeout(this.changing);
    this.changing = setTimeout(() => (this.changing = undefined), QUIET);
    this.now = stepOf(this.store.state);
    this.told(true);
  }

  undo() {
    const before = this.past.pop();
    if (!before) return;
    clearTimeout(this.changing);
    this.changing = undefined;
    this.restoring = true;
    this.restore(before);
    this.restoring = false;
    this.now = stepOf(this.store.state);
    this.told(this.past.length > 0);
  }
}

/** @param {State} state @returns {Step} */
function stepOf({ values, start, periods }) {
  return { values, start, periods };
}
