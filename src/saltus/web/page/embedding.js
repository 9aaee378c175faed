/** The page inside a notebook: it tells the notebook what the reader changes, and takes numbers, states and results from it. */

import { tamed } from "./description.js";

/** @typedef {import("./types.js").State} State */

const QUIET = 80; // milliseconds between two messages to the notebook: a moved slider has sixty states a second

/**
 * @typedef {object} Shown  What page and notebook agree on.
 * @property {Record<string, number>} values @property {Record<string, number>} start @property {number} periods
 */

/** What a state of the page says to the notebook. @param {State} state @returns {Shown} */
function shownOf({ values, start, periods }) {
  return { values, start, periods };
}

export class Embedding {
  /** @param {import("./main.js").Page} page @param {Window} notebook */
  constructor(page, notebook) {
    this.page = page;
    this.notebook = notebook;
    /** @type {ReturnType<typeof setTimeout>|undefined} */
    this.waiting = undefined;
    page.store.on(["values", "start", "periods"], () => this.later());
    addEventListener("message", (event) => event.source === notebook && this.heard(event.data?.saltus));
    this.post({ ready: true });
  }

  later() {
    this.waiting ??= setTimeout(() => this.tell(), QUIET);
  }

  tell() {
    clearTimeout(this.waiting);
    this.waiting = undefined;
    this.post(shownOf(this.page.store.state));
  }

  /** @param {any} message */
  post(message) {
    this.notebook.postMessage({ saltus: message }, "*"); // it holds nothing that others may not see
  }

  /** Take what the notebook says; what cannot be shown is refused, and the notebook is told what is shown. @param {any} said */
  heard(said) {
    if (!said || typeof said !== "object") return;
    const { page } = this;
    if (Array.isArray(said.results)) page.laidOver(said.results);
    if (said.theme === "dark" || said.theme === "light") page.store.set({ theme: said.theme });
    if (!said.values) return;
    const { state } = page.store;
    const { values, start, periods } = { ...shownOf(state), ...said };
    const asked = { values: { ...state.values, ...values }, start: { ...state.start, ...start }, periods };
    if (same(shownOf(state), asked)) return;
    page.replaceState(tamed({ ...state, ...asked, cursor: same(asked.start, state.start) ? state.cursor : (asked.start.time ?? 0), selected: null }, page.description));
    if (!same(shownOf(page.store.state), asked)) this.tell();
  }
}

/** @param {any} one @param {any} other */
function same(one, other) {
  return JSON.stringify(one) === JSON.stringify(other);
}
