/** The description of a system as the page uses it: its numbers, the state with which the page opens, and states from links. */

import { MOST_PERIODS } from "./session.js";
import { withinBounds } from "./checks.js";
import { clamp, inDigits } from "./numbers.js";

/** @typedef {import("./types.js").Description} Description */
/** @typedef {import("./types.js").State} State */
/** @typedef {import("./types.js").NumberEntry} NumberEntry */

const FIRST_SPEED = 4; // units of time per second

/** How many values a sweep may have each way, and periods at each. @type {{count: [number, number], periods: [number, number]}} */
export const SWEPT = { count: [2, 2000], periods: [1, MOST_PERIODS] };

/** What Python wrote, with every group of numbers as entries and with what may be left out filled in. @param {any} written @returns {Description} */
export function prepared(written) {
  const known = new Map((written.numbers ?? []).map((/** @type {NumberEntry} */ entry) => [entry.path, withinBounds(entry)]));
  const entries = (/** @type {(string|NumberEntry)[]} */ list) =>
    (list ?? []).map((each) => (typeof each === "string" ? known.get(each) : (known.get(each.path) ?? withinBounds(each)))).filter(Boolean);
  const margins = written.model.margins ?? [];
  const load = (written.load ?? []).map((/** @type {any} */ each) => ({ ...each, parameters: entries(each.parameters) }));
  const frequency = known.get("load.frequency");
  const grouped = load.some((/** @type {any} */ each) => each.parameters.includes(frequency));
  if (frequency && !grouped) load.unshift({ channel: "", kind: "frequency", parameters: [frequency] });
  return {
    ...written,
    model: {
      ...written.model, parameters: entries(written.model.parameters),
      margins: Array.isArray(margins) ? margins : Object.entries(margins).map(([name, kind]) => ({ name, kind })),
    },
    impact: written.impact && { ...written.impact, parameters: entries(written.impact.parameters) },
    load, start: written.start ?? { time: 0 }, digest: written.digest ?? "",
    study: { simulate: { periods: 20 }, system: written.system, ...written.study },
  };
}

/** Whether the load has a period. @param {Description} description */
export function isPeriodic(description) {
  return entriesOf(description).some(({ path }) => path === "load.frequency");
}

/** Whether the load is the same after each period, or at all times, so that motions settle under it. @param {Description} description */
export function goesOn(description) {
  return isPeriodic(description) || description.load.every(({ kind }) => kind === "Constant");
}

/** All numbers of a system, in the order in which the page shows them. @param {Description} description */
export function entriesOf(description) {
  const impact = description.impact?.parameters ?? [];
  return [...description.model.parameters, ...impact, ...description.load.flatMap(({ parameters }) => parameters)];
}

/** The state with which the page opens: the study itself. @param {Description} description @returns {State} */
export function firstState(description) {
  const entries = entriesOf(description);
  const values = Object.fromEntries(entries.map(({ path, value }) => [path, value]));
  const { simulate } = description.study;
  const swept = entries.find(({ path }) => path === "load.frequency") ?? entries[0];
  return {
    values, start: { ...description.start }, periods: Math.min(simulate.periods ?? simulate.duration ?? 20, MOST_PERIODS), cursor: description.start.time ?? 0,
    hover: null, playing: false, speed: FIRST_SPEED, coordinate: 0, degrees: entries.some(({ angle }) => angle), theme: "system",
    windows: {}, ranges: {}, selected: null,
    sweep: { path: swept?.path ?? "", low: inDigits(swept?.low ?? 0), high: inDigits(swept?.high ?? 1), count: 61, periods: 60 },
  };
}

/** The initial state and the duration as numbers with sliders. @param {Description} description @param {State} first @param {boolean} periodic @returns {NumberEntry[]} */
export function startEntries(description, first, periodic) {
  const states = description.model.coordinates.flatMap(({ name, velocity, unit, reach: [far, fast] = [2, 2] }) => {
    const angle = unit === "rad";
    const [x, v] = [first.start[name] ?? 0, first.start[velocity] ?? 0];
    const [dx, dv] = [Math.max(far, 2 * Math.abs(x)), Math.max(fast, 2 * Math.abs(v))];
    return [
      { path: `start.${name}`, unit, value: x, low: -dx, high: dx, angle, symbol: name },
      { path: `start.${velocity}`, unit: "1", value: v, low: -dv, high: dv, symbol: `${name}_velocity` },
    ];
  });
  const time = { path: "start.time", unit: "1", value: first.start.time ?? 0, low: 0, high: 2 * Math.PI, symbol: "tau" };
  const lasting = { path: periodic ? "start.periods" : "start.duration", unit: periodic ? "T" : "1", value: first.periods, low: 1, high: Math.max(120, first.periods) };
  return [...states, time, lasting];
}

/** A state from a link within what the page can do. @param {State} state @param {Description} description */
export function tamed(state, description) {
  const count = description.model.coordinates.length;
  const coordinate = Number.isInteger(state.coordinate) && state.coordinate < count ? state.coordinate : 0;
  const result = state.selected && description.results?.[state.selected.result];
  const points = result?.branches?.[state.selected?.branch ?? -1]?.parameter.length ?? 0;
  const selected = state.selected && state.selected.point < points ? state.selected : null;
  const sweep = { ...state.sweep, count: clamp(state.sweep.count, ...SWEPT.count), periods: clamp(state.sweep.periods, ...SWEPT.periods) };
  return { ...state, coordinate, selected, sweep, periods: clamp(state.periods, 1e-9, MOST_PERIODS), speed: clamp(state.speed, 1e-3, 1e3) };
}

/** A class's name in words: WallOscillator as wall oscillator. @param {string} name */
export function spaced(name) {
  return name.replace(/^.*:/, "").replace(/(?<=[a-z])(?=[A-Z])/g, " ").toLowerCase().replace(/^./, (letter) => letter.toUpperCase());
}
