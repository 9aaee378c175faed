/** Where the page begins: it reads what Python has put into it, opens the engine, and makes the page. */

import { open } from "./engine.js";
import { Page } from "./main.js";
import { prepared } from "./description.js";

/** What stands in a data block of the page. @param {string} id */
function block(id) {
  return document.getElementById(id)?.textContent ?? "";
}

/** Bytes from base64 text of a gzip file. @param {string} text */
export async function unpacked(text) {
  const packed = Uint8Array.from(atob(text.trim()), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** A worker of the text that stands in the page. @param {Uint8Array} text @returns {any} */
function workerOf(text) {
  const address = URL.createObjectURL(new Blob([/** @type {any} */ (text)], { type: "text/javascript" }));
  const worker = new Worker(address);
  URL.revokeObjectURL(address);
  return worker;
}

async function boot() {
  const notice = document.getElementById("notice");
  try {
    const written = JSON.parse(block("description"));
    const description = prepared(written);
    const [wasm, worker] = await Promise.all(["wasm", "worker"].map((id) => unpacked(block(id))));
    const makeWorker = () => workerOf(/** @type {Uint8Array} */ (worker));
    const engine = /** @type {any} */ (await open(/** @type {Uint8Array} */ (wasm), written));
    Object.assign(globalThis, { saltusPage: new Page({ engine, description, makeWorker, wasm: wasm ?? null }) });
  } catch (error) {
    if (!notice) return;
    notice.hidden = false;
    notice.textContent = `This page cannot compute here: ${error instanceof Error ? error.message : String(error)}`;
  }
}

boot();
