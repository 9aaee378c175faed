/** A worker that follows motions from many states, and says on which cycle each of them ends: the cells of basins. */

import { open } from "./engine.js";
import { Settling } from "./settling.js";

/** @type {Promise<Settling>|null} */
let settling = null;

self.onmessage = async ({ data }) => {
  try {
    if (data.kind === "open") settling = open(data.wasm, data.description).then((engine) => new Settling(/** @type {any} */ (engine), data.description));
    const ready = await settling;
    self.postMessage(data.kind === "cells" && ready ? ready.cells(data) : { ready: true });
  } catch (error) {
    self.postMessage({ error: error instanceof Error ? error.message : String(error) });
  }
};
