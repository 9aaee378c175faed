/**
 * The whole state in the address of the page, behind its "#": only what differs from the study, readable, and with a check sum
 * over it and the system's digest, so that a damaged link, or one of another page, is never shown as if it were right.
 */

import { wideEnough } from "./plot.js";

/** @typedef {import("./types.js").State} State */
/** @typedef {import("./types.js").Description} Description */

const NUMBERS = /** @type {const} */ (["periods", "cursor", "speed", "coordinate"]);
const SWEEP_NUMBERS = /** @type {const} */ (["low", "high", "count", "periods"]);
const LONGEST = 20000; // characters of a link

/** The link of a state, without "#"; empty for the state of the study itself. @param {State} state @param {State} first @param {Description} description */
export function linkOf(state, first, description) {
  /** @type {[string, string][]} */
  const parts = [];
  for (const group of /** @type {const} */ (["values", "start"])) {
    for (const [name, value] of Object.entries(state[group])) {
      if (!Object.is(value, first[group][name])) parts.push([`${group === "start" ? "start." : ""}${name}`, String(value)]);
    }
  }
  for (const name of NUMBERS) if (state[name] !== first[name]) parts.push([`show.${name}`, String(state[name])]);
  if (state.degrees !== first.degrees) parts.push(["show.degrees", state.degrees ? "1" : "0"]);
  if (state.theme !== first.theme) parts.push(["show.theme", state.theme]);
  for (const [name, list] of Object.entries(state.windows)) if (list) parts.push([`window.${name}`, list.join("_")]);
  for (const [name, list] of Object.entries(state.ranges)) parts.push([`range.${name}`, list.join("_")]);
  if (state.sweep.path !== first.sweep.path) parts.push(["sweep.path", state.sweep.path]);
  for (const name of SWEEP_NUMBERS) if (state.sweep[name] !== first.sweep[name]) parts.push([`sweep.${name}`, String(state.sweep[name])]);
  if (state.selected) parts.push(["show.selected", [state.selected.result, state.selected.branch, state.selected.point].join("_")]);
  if (!parts.length) return "";
  const text = parts.map(([name, value]) => `${name}=${value}`).join("&");
  return `${text}&check=${checkSum(text, description.digest)}`;
}

/**
 * The state that a link holds; null with a sentence where it is damaged or belongs to another page.
 * @param {string} link @param {State} first @param {Description} description
 * @returns {{state: State}|{refusal: string}}
 */
export function stateOf(link, first, description) {
  if (!link) return { state: first };
  const damaged = { refusal: "This link is damaged or belongs to another page; the page shows its own study." };
  const found = link.length <= LONGEST && /^(.*)&check=([0-9a-f]{16})$/.exec(link);
  if (!found || checkSum(found[1] ?? "", description.digest) !== found[2]) return damaged;
  /** @type {State} */
  const state = { ...first, values: { ...first.values }, start: { ...first.start }, windows: {}, ranges: {}, sweep: { ...first.sweep } };
  for (const part of (found[1] ?? "").split("&")) {
    const at = part.indexOf("=");
    if (at < 0 || !take(state, part.slice(0, at), part.slice(at + 1), first)) return damaged;
  }
  return { state };
}

/** Take one part of a link; false where there is no such thing. @param {State} state @param {string} name @param {string} text @param {State} first */
function take(state, name, text, first) {
  const number = finite(text);
  if (Object.hasOwn(first.values, name)) return number !== null && assign(state.values, name, number);
  const [group, ...rest] = name.split(".");
  const key = rest.join(".");
  if (group === "start" && Object.hasOwn(first.start, key)) return number !== null && assign(state.start, key, number);
  if (group === "window") return takeWindow(state, key, text);
  if (group === "range" && (Object.hasOwn(first.values, key) || key.startsWith("start."))) return takeRange(state, key, text);
  if (group === "sweep") return takeSweep(state, key, text, number, first);
  return group === "show" && takeShown(state, key, text, number);
}

/** @param {Record<string, number>} target @param {string} name @param {number} value */
function assign(target, name, value) {
  target[name] = value;
  return true;
}

/** @param {State} state @param {string} key @param {string} text */
function takeWindow(state, key, text) {
  const list = text.split("_").map(finite);
  if (!/^[a-z]{1,20}\d?$/.test(key) || list.some((value) => value === null) || !wideEnough(/** @type {number[]} */ (list))) return false;
  state.windows[key] = /** @type {number[]} */ (list);
  return true;
}

/** @param {State} state @param {string} key @param {string} text */
function takeRange(state, key, text) {
  const [low, high, ...more] = text.split("_").map(finite);
  if (low == null || high == null || more.length || !(low < high)) return false;
  state.ranges[key] = [low, high];
  return true;
}

/** @param {State} state @param {string} key @param {string} text @param {number|null} number @param {State} first */
function takeSweep(state, key, text, number, first) {
  if (key === "path") {
    state.sweep.path = text;
    return Object.hasOwn(first.values, text);
  }
  const known = SWEEP_NUMBERS.find((name) => name === key);
  if (!known || number === null) return false;
  state.sweep[known] = number;
  return true;
}

/** @param {State} state @param {string} key @param {string} text @param {number|null} number */
function takeShown(state, key, text, number) {
  const known = NUMBERS.find((name) => name === key);
  if (known) {
    if (number === null || (known !== "cursor" && number < 0)) return false;
    state[known] = number;
    return true;
  }
  if (key === "degrees") state.degrees = text === "1";
  else if (key === "theme" && (text === "light" || text === "dark" || text === "system")) state.theme = text;
  else if (key === "selected") {
    const [result, branch, point] = text.split("_").map(Number);
    if (![result, branch, point].every((each) => Number.isInteger(each) && Number(each) >= 0)) return false;
    state.selected = { result: Number(result), branch: Number(branch), point: Number(point) };
  } else return false;
  return true;
}

/** A finite number that is written as the page writes one, or null. @param {string} text */
function finite(text) {
  const value = Number(text);
  return /^-?[\d.]+(e[+-]?\d+)?$/.test(text) && Number.isFinite(value) ? value : null;
}

/** Two FNV-1a sums of 32 bits, over the text forwards and backwards. @param {string} text @param {string} digest */
export function checkSum(text, digest) {
  const whole = `${digest}|${text}`;
  const forwards = fnv([...whole]);
  const backwards = fnv([...whole].reverse());
  return [forwards, backwards].map((sum) => sum.toString(16).padStart(8, "0")).join("");
}

/** @param {string[]} letters */
function fnv(letters) {
  let sum = 0x811c9dc5;
  for (const letter of letters) {
    sum ^= letter.codePointAt(0) ?? 0;
    sum = Math.imul(sum, 0x01000193) >>> 0;
  }
  return sum;
}
