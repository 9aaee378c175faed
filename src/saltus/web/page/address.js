/** The address of the page: it follows the state, and the state follows a link that is opened. */

import { linkOf, stateOf } from "./link.js";

/** @typedef {import("./types.js").State} State */

const WAIT = 300; // milliseconds of quiet before the address is written: a browser allows only so many changes

export class Address {
  /**
   * @param {import("./store.js").Store} store @param {State} first @param {import("./types.js").Description} description
   * @param {(found: {state: State}|{refusal: string}) => void} opened
   */
  constructor(store, first, description, opened) {
    this.store = store;
    this.first = first;
    this.description = description;
    this.opened = opened;
    this.written = location.hash.slice(1);
    /** @type {ReturnType<typeof setTimeout>|undefined} */
    this.waiting = undefined;
    addEventListener("hashchange", () => this.changed());
  }

  later() {
    clearTimeout(this.waiting);
    this.waiting = setTimeout(() => this.write(), WAIT);
  }

  write() {
    this.written = linkOf(this.store.state, this.first, this.description);
    try {
      history.replaceState(null, "", this.written ? `#${this.written}` : "#");
    } catch {
      // A browser may refuse it in a sandboxed frame; the page works without.
    }
  }

  /** Put the link into the clipboard; returns what is said. */
  async copy() {
    this.write();
    try {
      await navigator.clipboard.writeText(location.href);
      return "The link is copied.";
    } catch {
      return "The link is in the address bar.";
    }
  }

  changed() {
    const link = location.hash.slice(1);
    if (link !== this.written) this.opened(stateOf(link, this.first, this.description));
  }
}
