/** A page with the stand-in engine, for tests of what is seen. */
import { standIn } from "./stand_in.js";
import { Page } from "./main.js";

const description = JSON.parse(document.getElementById("description").textContent);
globalThis.saltusPage = new Page({ engine: standIn(description), description, makeWorker: () => ({ postMessage() {}, terminate() {}, onmessage: null }), wasm: null });
