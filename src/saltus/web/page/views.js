/** The four views of a motion: phase plane, time history, stroboscopic section, energy. They share one time and one selection. */

import { allDigits, clamp, rangeOf, shortly } from "./numbers.js";
import { energiesBetween } from "./session.js";
import { asText, symbolOf } from "./symbols.js";

/** @typedef {import("./session.js").Session} Session */
/** @typedef {import("./plot.js").Painter} Painter */
/** @typedef {import("./plot.js").Plot} Plot */
/** @typedef {import("./plot.js").Window} Window */
/** @typedef {import("./plot.js").PlotOptions} PlotOptions */
/** @typedef {Omit<PlotOptions, "zoomed"|"window"> & {csv: () => Record<string, ArrayLike<number>>}} View */

const MOST_NAMED = 6; // coordinates in a sentence
const NEAR = 12; // pixels from which a click or the cursor takes hold of a point
const PER_PIXEL = 3; // samples of a curve over time
const TIME = ["time ", symbolOf("tau")];

/** @param {Session} session */
function coordinateOf(session) {
  const { coordinates } = session;
  return /** @type {import("./types.js").CoordinateEntry} */ (coordinates[session.store.state.coordinate] ?? coordinates[0]);
}

/** An axis's name: its symbol, and its unit if it has one. @param {string} name @param {string} unit */
export function axisName(name, unit) {
  return [symbolOf(name), ...(unit && unit !== "1" ? [` (${unit})`] : [])];
}

/** The unit of a coordinate as an axis shows it. @param {{unit: string}} coordinate */
function unitOf(coordinate) {
  return coordinate.unit === "1" ? "" : coordinate.unit;
}

/** The least and largest of two columns, as a window. @param {ArrayLike<number>[]} xs @param {ArrayLike<number>[]} ys @returns {Window|null} */
function around(xs, ys) {
  const [x, y] = [rangeOf(xs), rangeOf(ys)];
  return x && y ? [x.low, x.high, y.low, y.high] : null;
}

/** A coordinate in a sentence: a symbol where it is a letter, else its name. @param {string} name */
function called(name) {
  const symbol = symbolOf(name);
  return symbol.italic ? asText(symbol) : name.replace(/_/g, " ");
}

/** The least and largest coordinates of the motion, and the largest kinetic energy, in words. @param {Session} session */
export function extremaOf(session) {
  const { motion } = session;
  if (!motion) return "";
  const shown = session.coordinates.slice(0, MOST_NAMED).flatMap(({ name, unit }) => {
    const range = rangeOf([session.column(name)]);
    return range ? [`${called(name)} from ${shortly(range.low, 5)} to ${shortly(range.high, 5)}${unit === "1" ? "" : ` ${unit}`}`] : [];
  });
  const most = rangeOf([session.energies(motion).found])?.high;
  return [...shown, ...(most === undefined ? [] : [`kinetic energy up to ${shortly(most, 4)}`])].join("; ");
}

/** The phase plane. @param {Session} session @param {(x: number, y: number) => void} startAt @param {(p: Painter) => void} [beneath] @returns {View} */
export function phasePlane(session, startAt, beneath) {
  const columns = () => {
    const { name, velocity } = coordinateOf(session);
    return [session.column(name), session.column(velocity)];
  };
  return {
    id: "phase", title: "Phase plane",
    instructions: "A click, or Enter at the cursor, starts a motion there.",
    axes: () => {
      const coordinate = coordinateOf(session);
      return { x: { name: axisName(coordinate.name, unitOf(coordinate)) }, y: { name: axisName(`${coordinate.name}_velocity`, unitOf(coordinate)) } };
    },
    bounds: () => {
      const [xs, ys] = columns();
      return around([xs ?? []], [ys ?? []]);
    },
    empty: () => session.refusal?.message ?? "There is no motion.",
    paint: (painter) => {
      const [xs, ys] = /** @type {[Float64Array, Float64Array]} */ (columns());
      beneath?.(painter);
      const from = lastPeriodFrom(session);
      painter.curve(xs.subarray(0, from + 1), ys.subarray(0, from + 1), { color: painter.palette.separatrix, width: 0.7, alpha: 0.7 });
      painter.curve(xs.subarray(from), ys.subarray(from), { color: painter.palette.stable, width: 1.8 });
      walls(session, painter);
      painter.ring(xs[0] ?? NaN, ys[0] ?? NaN, painter.palette.soft, 4);
    },
    over: (painter) => marked(session, painter, (state) => planePoint(session, state)),
    act: startAt,
    read: (x, y, plot) => {
      const near = nearest(session, plot, x, y);
      session.store.set({ hover: near });
      return near === null ? coordinatesRead(session, x, y) : stateRead(session, near);
    },
    leave: () => session.store.set({ hover: null }),
    csv: () => {
      const { name, velocity } = coordinateOf(session);
      return { time: session.curve.time, [name]: session.column(name), [velocity]: session.column(velocity) };
    },
  };
}

/** Contacts at a fixed value of the coordinate that is shown, as green lines. @param {Session} session @param {Painter} painter */
function walls(session, painter) {
  const { name } = coordinateOf(session);
  for (const contact of session.description.model.contacts ?? []) {
    if (contact.coordinate !== name) continue;
    const place = typeof contact.path === "string" ? (contact.sign_of_path ?? 1) * (session.store.state.values[contact.path] ?? NaN) : contact.position;
    if (Number.isFinite(place)) painter.vertical(place, { color: painter.palette.limit, width: 1.1, dash: [7, 3, 1.5, 3] });
  }
}

/** Where the last forcing period begins in the sampled curve. @param {Session} session */
function lastPeriodFrom(session) {
  const { motion, period, curve } = session;
  if (!motion || !period) return 0;
  const from = motion.time.last - period * 1.0001;
  let i = curve.length - 1;
  while (i > 0 && (curve.time[i] ?? 0) > from) i--;
  return Math.max(i, 0);
}

/** @param {Session} session @param {ArrayLike<number>} state @returns {[number, number]} */
function planePoint(session, state) {
  const { coordinate } = session.store.state;
  return [state[coordinate] ?? NaN, state[coordinate + session.coordinates.length] ?? NaN];
}

/** The marks that all views share: the time that is shown, and the one under the pointer. @param {Session} session @param {Painter} painter @param {(state: ArrayLike<number>, time: number) => [number, number]} place */
function marked(session, painter, place) {
  const { cursor, hover } = session.store.state;
  const now = session.stateAt(cursor);
  if (now) painter.mark(...place(now, cursor), painter.palette.ink, 4.5);
  const other = hover === null ? null : session.stateAt(hover);
  if (other && hover !== null) painter.ring(...place(other, hover), painter.palette.ink, 6);
}

/** The time at which the curve of the phase plane is nearest to a point, or null where none is near. @param {Session} session @param {Plot} plot @param {number} x @param {number} y */
function nearest(session, plot, x, y) {
  const { name, velocity } = coordinateOf(session);
  const [xs, ys, times] = [session.column(name), session.column(velocity), session.curve.time];
  const [x0, x1, y0, y1] = plot.seen();
  const [sx, sy] = [plot.width / (x1 - x0), plot.height / (y1 - y0)];
  let [least, at] = [NEAR * NEAR, -1];
  for (let i = 0; i < xs.length; i++) {
    const distance = (((xs[i] ?? 0) - x) * sx) ** 2 + (((ys[i] ?? 0) - y) * sy) ** 2;
    if (distance <= least) [least, at] = [distance, i];
  }
  return at < 0 ? null : (times[at] ?? null);
}

/** @param {Session} session @param {number} time */
function stateRead(session, time) {
  const state = session.stateAt(time);
  const coordinates = session.coordinates.map(({ name }) => name);
  const names = [...coordinates, ...coordinates.map((name) => `${name}_velocity`)];
  const parts = names.map((name, i) => `${asText(symbolOf(name))} = ${allDigits(state?.[i] ?? NaN)}`);
  return `τ = ${allDigits(time)}, ${parts.join(", ")}`;
}

/** @param {Session} session @param {number} x @param {number} y */
function coordinatesRead(session, x, y) {
  const { name } = coordinateOf(session);
  return `${asText(symbolOf(name))} = ${shortly(x)}, ${asText(symbolOf(`${name}_velocity`))} = ${shortly(y)}`;
}

/** The time history of the coordinates. @param {Session} session @param {(time: number) => void} show @returns {View} */
export function timeHistory(session, show) {
  const names = () => session.coordinates.map(({ name }) => name);
  return {
    id: "history", title: "Time history", instructions: "A click shows that time.",
    axes: () => {
      const coordinate = coordinateOf(session);
      return { x: { name: TIME }, y: { name: axisName(coordinate.name, unitOf(coordinate)) } };
    },
    bounds: () => around([session.curve.time], names().map((name) => session.column(name))),
    empty: () => "There is no motion.",
    paint: (painter) => {
      const found = seenMotion(session, painter);
      if (!found) return;
      const chosen = coordinateOf(session).name;
      for (const name of names()) {
        const other = { color: painter.palette.separatrix, width: 0.8 };
        painter.curve(found.time ?? [], found[name] ?? [], name === chosen ? { color: painter.palette.stable, width: 1.3 } : other);
      }
      strokesOfImpacts(session, painter);
    },
    over: (painter) => {
      const { cursor } = session.store.state;
      painter.vertical(cursor, { color: painter.palette.ink, width: 0.8 });
      marked(session, painter, (state, time) => [time, state[session.store.state.coordinate] ?? NaN]);
    },
    act: (x) => show(x),
    read: (x) => overTime(session, x),
    leave: () => session.store.set({ hover: null }),
    csv: () => ({ time: session.curve.time, ...Object.fromEntries(names().map((name) => [name, session.column(name)])) }),
  };
}

/** @param {Session} session @param {number} time */
function overTime(session, time) {
  const { motion } = session;
  if (!motion || time < motion.time.first || time > motion.time.last) return null;
  session.store.set({ hover: time });
  return stateRead(session, time);
}

/** The part of the motion that a window over time shows, sampled for its width. @param {Session} session @param {Painter} painter */
function seenMotion(session, painter) {
  const { motion } = session;
  if (!motion) return null;
  const from = clamp(painter.window[0], motion.time.first, motion.time.last);
  const to = clamp(painter.window[1], motion.time.first, motion.time.last);
  const count = Math.max(2, Math.round(painter.box.width * PER_PIXEL));
  return motion.sample(new Float64Array(count + 1).map((_, i) => from + ((to - from) * i) / count));
}

/** Impacts as short strokes at the lower edge. @param {Session} session @param {Painter} painter */
function strokesOfImpacts(session, painter) {
  const [x0, x1, y0, y1] = painter.window;
  const seen = (session.motion?.events ?? []).filter(({ kind, time }) => kind === "impact" && time >= x0 && time <= x1);
  if (seen.length > painter.box.width / 2) return;
  const top = y0 + 0.045 * (y1 - y0);
  const times = seen.flatMap(({ time }) => [time, time, NaN]); // one path: many short ones take longer to draw
  painter.curve(times, times.map((_, i) => (i % 3 ? top : y0)), { color: painter.palette.ink, width: 0.9 });
}

/** The stroboscopic section. @param {Session} session @param {(time: number) => void} show @returns {View} */
export function stroboscopic(session, show) {
  const points = () => {
    const section = session.section();
    const { name, velocity } = coordinateOf(session);
    return section ? { times: section.times, xs: section.lists[name] ?? [], ys: section.lists[velocity] ?? [] } : null;
  };
  const closest = (/** @type {number} */ x, /** @type {number} */ y, /** @type {Plot} */ plot) => {
    const found = points();
    const [x0, x1, y0, y1] = plot.seen();
    let [least, at] = [(2 * NEAR) ** 2, -1];
    for (let i = 0; found && i < found.xs.length; i++) {
      const [dx, dy] = [((found.xs[i] ?? 0) - x) / (x1 - x0), ((found.ys[i] ?? 0) - y) / (y1 - y0)];
      const distance = (dx * plot.width) ** 2 + (dy * plot.height) ** 2;
      if (distance <= least) [least, at] = [distance, i];
    }
    return at < 0 ? null : (found?.times[at] ?? null);
  };
  return {
    id: "section", title: "Stroboscopic section", instructions: "A click on a point shows that time.",
    axes: () => {
      const c = coordinateOf(session);
      return { x: { name: axisName(c.name, unitOf(c)) }, y: { name: axisName(`${c.name}_velocity`, unitOf(c)) } };
    },
    bounds: () => {
      const found = points();
      return found ? around([found.xs], [found.ys]) : null;
    },
    empty: () => (session.period ? "There is no motion." : "This load has no period, so there is no stroboscopic section."),
    paint: (painter) => {
      const found = points();
      if (!found) return;
      const from = Math.floor(found.xs.length / 2);
      painter.dots(Array.from(found.xs).slice(0, from), Array.from(found.ys).slice(0, from), painter.palette.separatrix, 1.8);
      painter.dots(Array.from(found.xs).slice(from), Array.from(found.ys).slice(from), painter.palette.stable, 2.6);
    },
    over: (painter) => {
      const { cursor } = session.store.state;
      if (!session.period) return;
      const last = session.stateAt(Math.floor(cursor / session.period + 1e-9) * session.period);
      if (last) painter.mark(...planePoint(session, last), painter.palette.ink, 4.5);
    },
    act: (x, y, plot) => {
      const time = closest(x, y, plot);
      if (time !== null) show(time);
    },
    read: (x, y, plot) => {
      const time = closest(x, y, plot);
      session.store.set({ hover: time });
      return time === null ? coordinatesRead(session, x, y) : stateRead(session, time);
    },
    leave: () => session.store.set({ hover: null }),
    csv: () => {
      const found = points();
      const { name, velocity } = coordinateOf(session);
      return found ? { time: found.times, [name]: found.xs, [velocity]: found.ys } : /** @type {Record<string, number[]>} */ ({});
    },
  };
}

/** Kinetic energy over time. @param {Session} session @param {(time: number) => void} show @returns {View} */
export function energyView(session, show) {
  const whole = () => (session.motion ? session.energies(session.motion) : null);
  return {
    id: "energy", title: "Kinetic energy", instructions: "A click shows that time.",
    axes: () => ({ x: { name: TIME }, y: { name: ["kinetic energy ", symbolOf("T")], low: undefined } }),
    bounds: () => {
      const all = whole();
      return all ? around([all.times], [all.found]) : null;
    },
    empty: () => (session.motion ? "The model gives no kinetic energy." : "There is no motion."),
    paint: (painter) => {
      const { motion } = session;
      if (!motion) return;
      const from = clamp(painter.window[0], motion.time.first, motion.time.last);
      const to = clamp(painter.window[1], motion.time.first, motion.time.last);
      const all = from === motion.time.first && to === motion.time.last ? whole() : null;
      const { times, found } = all ?? energiesBetween(motion, from, to);
      painter.curve(times, found, { color: painter.palette.stable, width: 1.2 });
      strokesOfImpacts(session, painter);
    },
    over: (painter) => {
      const { cursor, hover } = session.store.state;
      painter.vertical(cursor, { color: painter.palette.ink, width: 0.8 });
      const energy = session.motion?.energy;
      if (energy) painter.mark(cursor, energy.call(session.motion, cursor) ?? NaN, painter.palette.ink, 4.5);
      if (energy && hover !== null) painter.ring(hover, energy.call(session.motion, hover) ?? NaN, painter.palette.ink, 6);
    },
    act: (x) => show(x),
    read: (x) => {
      const said = overTime(session, x);
      return said && `τ = ${allDigits(x)}, T = ${allDigits(session.motion?.energy?.(x) ?? NaN)}`;
    },
    leave: () => session.store.set({ hover: null }),
    csv: () => {
      const all = whole();
      return all ? { time: all.times, kinetic_energy: all.found } : /** @type {Record<string, number[]>} */ ({});
    },
  };
}
