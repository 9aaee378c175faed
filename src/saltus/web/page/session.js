/** The system and the motion that the page shows, computed from its state by the engine; and what is refused, with its sentence. */

import { clamp } from "./numbers.js";
import { refusedNumbers } from "./checks.js";

/** @typedef {import("./types.js").Description} Description */
/** @typedef {import("./types.js").Engine} Engine */
/** @typedef {import("./types.js").Motion} Motion */
/** @typedef {import("./types.js").State} State */
/** @typedef {import("./types.js").NumberEntry} NumberEntry */

const PER_PERIOD = 144; // samples of a forcing period for the curve in the phase plane
const LONG = 30; // periods of a motion that is sampled half as closely, to be drawn within a frame
const OVERVIEW = 900; // samples of the energy over what is seen
const MOST_SAMPLES = 20000; // of a whole motion: more of them are no longer drawn within a frame
export const MOST_PERIODS = 2000; // of a motion on the page, which remembers every step of it

export class Session {
  /** @param {Engine} engine @param {Description} description @param {import("./store.js").Store} store */
  constructor(engine, description, store) {
    this.engine = engine;
    this.description = description;
    this.store = store;
    const { model, impact, load } = description;
    this.entries = [...model.parameters, ...(impact?.parameters ?? []), ...load.flatMap(({ parameters }) => parameters)];
    /** @type {import("./types.js").EngineSystem|null} */
    this.system = null;
    /** @type {Motion|null} */
    this.motion = null;
    /** Where a number was refused, and the sentence. @type {{where: string, message: string}|null} */
    this.refusal = null;
    this.curve = emptyCurve();
    /** The section of a motion, which several views ask for. @type {{motion: Motion|null, found: {times: Float64Array, lists: Record<string, Float64Array>}|null}} */
    this.sectionOf = { motion: null, found: null };
    /** The kinetic energy over a motion, likewise. @type {{motion: Motion|null, times: Float64Array, found: Float64Array}} */
    this.energiesOf = { motion: null, times: new Float64Array(0), found: new Float64Array(0) };
  }

  /** The kinetic energy over the whole motion; NaN where the model has none. @param {Motion} motion */
  energies(motion) {
    if (this.energiesOf.motion !== motion) this.energiesOf = { motion, ...energiesBetween(motion, motion.time.first, motion.time.last) };
    return this.energiesOf;
  }

  get coordinates() {
    return this.description.model.coordinates;
  }

  get period() {
    return this.system?.period ?? null;
  }

  /** How long the motion lasts, in units of time. @param {State} [state] */
  duration(state = this.store.state) {
    return state.periods * (this.period ?? 1);
  }

  /** As the study asks for it, so that the motion is Python's. @param {State} state */
  options(state) {
    const tolerance = this.description.study.simulate.tol;
    return { ...(tolerance === undefined ? {} : { tolerance }), ...(this.system?.period ? { periods: state.periods } : {}) };
  }

  /** Whether these numbers are accepted: null, or what the engine refuses. @param {Record<string, number>} values */
  refusalOf(values) {
    const refused = refusedNumbers(this.entries, values);
    if (refused) return refused;
    try {
      this.engine.system(values);
      return null;
    } catch (error) {
      return refusalFrom(error);
    }
  }

  /** Make the system and its motion anew. */
  compute() {
    const state = this.store.state;
    this.refusal = this.refusalOf(state.values);
    if (this.refusal) {
      this.motion = null;
      this.curve = emptyCurve();
      return;
    }
    try {
      this.system = this.engine.system(state.values);
      this.motion = this.engine.simulate(this.system, state.start, this.duration(state), this.options(state));
      this.curve = this.sampled(this.motion);
    } catch (error) {
      this.refusal = refusalFrom(error);
      this.motion = null;
      this.curve = emptyCurve();
    }
  }

  /** The motion along its curve: even samples, and both velocities at every event. @param {Motion} motion */
  sampled(motion) {
    const { first, last } = motion.time;
    const events = motion.events;
    const period = this.period ?? (last - first) / LONG;
    const step = ((last - first > LONG * period ? 2 : 1) * period) / PER_PERIOD;
    const count = clamp(Math.ceil((last - first) / step), 2, MOST_SAMPLES - 2 * Math.min(events.length, MOST_SAMPLES / 4));
    const times = new Float64Array(count + 1 + events.length);
    let [at, next] = [0, 0];
    for (let i = 0; i <= count; i++) {
      const time = i === count ? last : first + ((last - first) * i) / count;
      while (next < events.length && /** @type {any} */ (events[next]).time <= time) times[at++] = /** @type {any} */ (events[next++]).time;
      if (at && times[at - 1] === time) continue;
      times[at++] = time;
    }
    return this.withJumps(motion, times.subarray(0, at));
  }

  /** @param {Motion} motion @param {Float64Array} times */
  withJumps(motion, times) {
    const jumps = motion.events.filter((event) => event.kind === "impact" || event.kind === "held" || event.kind === "rest");
    const found = motion.sample(times);
    const size = times.length + jumps.length;
    const names = this.coordinates.flatMap(({ name, velocity }) => [name, velocity]);
    /** @type {Record<string, Float64Array>} */
    const lists = Object.fromEntries(["time", ...names].map((name) => [name, new Float64Array(size)]));
    // of each point of the curve: its sample, and the jump before which it is, or -1
    const [samples, before] = [new Int32Array(size), new Int32Array(size).fill(-1)];
    let [at, next] = [0, 0];
    for (let i = 0; i < times.length; i++) {
      if (next < jumps.length && jumps[next]?.time === times[i]) {
        samples[at] = i;
        before[at++] = next++;
      }
      if (at < size) samples[at++] = i;
    }
    const copied = (/** @type {Float64Array} */ into, /** @type {ArrayLike<number>} */ from) => {
      for (let i = 0; i < at; i++) into[i] = from[samples[i] ?? 0] ?? NaN;
    };
    const { time = new Float64Array(0) } = lists;
    copied(time, times);
    this.coordinates.forEach(({ name, velocity }, k) => {
      copied(/** @type {Float64Array} */ (lists[name]), found[name] ?? []);
      const speeds = /** @type {Float64Array} */ (lists[velocity]);
      copied(speeds, found[velocity] ?? []);
      for (let i = 0; i < at; i++) if ((before[i] ?? -1) >= 0) speeds[i] = jumps[before[i] ?? 0]?.before[k] ?? NaN;
    });
    return { time: time.subarray(0, at), lists, length: at };
  }

  /** One column of the sampled curve. @param {string} name */
  column(name) {
    const list = this.curve.lists[name];
    return list ? list.subarray(0, this.curve.length) : new Float64Array(0);
  }

  /** The state at a time: coordinates, then velocities. @param {number} time */
  stateAt(time) {
    const motion = this.motion;
    if (!motion) return null;
    return motion.state(clamp(time, motion.time.first, motion.time.last));
  }

  /** The stroboscopic section: the states at the ends of the forcing periods. */
  section() {
    const motion = this.motion;
    if (!motion || !this.period) return null;
    if (this.sectionOf.motion !== motion) this.sectionOf = { motion, found: this.sectionAnew(motion, this.period) };
    return this.sectionOf.found;
  }

  /** @param {Motion} motion @param {number} period */
  sectionAnew(motion, period) {
    const first = Math.ceil(motion.time.first / period - 1e-9);
    const last = Math.floor(motion.time.last / period + 1e-9);
    const times = new Float64Array(Math.max(last - first + 1, 0)).map((_, i) =>
      clamp((first + i) * period, motion.time.first, motion.time.last),
    );
    return { times, lists: motion.sample(times) };
  }

  /** A load channel's value at a time, or 0. @param {string} channel @param {number} time */
  load(channel, time) {
    if (this.engine.load && this.system) return this.engine.load(this.system, channel, time);
    return plainLoad(this.description, this.store.state.values, channel, time);
  }
}

/** The kinetic energy at even times. @param {Motion} motion @param {number} from @param {number} to */
export function energiesBetween(motion, from, to) {
  const times = new Float64Array(OVERVIEW + 1).map((_, i) => from + ((to - from) * i) / OVERVIEW);
  return { times, found: times.map((time) => motion.energy?.(time) ?? NaN) };
}

/** @returns {{time: Float64Array, lists: Record<string, Float64Array>, length: number}} */
function emptyCurve() {
  return { time: new Float64Array(0), lists: /** @type {Record<string, Float64Array>} */ ({}), length: 0 };
}

/** @param {any} error @returns {{where: string, message: string}} */
export function refusalFrom(error) {
  const message = typeof error?.message === "string" ? error.message : String(error);
  return { where: typeof error?.where === "string" ? error.where : "", message };
}

/** Constants and harmonics, by the numbers of a channel. @param {Description} description @param {Record<string, number>} values @param {string} channel @param {number} time */
export function plainLoad(description, values, channel, time) {
  const rate = values["load.frequency"] ?? 0;
  let total = 0;
  for (const entry of description.load.filter((each) => each.channel === channel)) {
    const numbers = Object.fromEntries(entry.parameters.map((each) => [each.path.split(".").pop(), values[each.path] ?? 0]));
    if (entry.kind === "Sum") total += sumAt(entry, values, time);
    if (entry.kind === "Constant") total += values[entry.parameters[0]?.path ?? ""] ?? 0;
    if (entry.kind === "Harmonic") {
      const argument = (numbers.order ?? 1) * rate * time + (numbers.phase ?? 0);
      total += (numbers.mean ?? 0) + (numbers.amplitude ?? 0) * Math.sin(argument);
    }
  }
  return total;
}

/** A sum of constants and harmonics, whose terms are numbered in their paths. @param {import("./types.js").LoadEntry} entry @param {Record<string, number>} values @param {number} time */
function sumAt(entry, values, time) {
  /** @type {Record<string, Record<string, number>>} */
  const terms = {};
  for (const { path } of entry.parameters) {
    const [, , term = "", name = "mean"] = path.split(".");
    terms[term] = { ...terms[term], [name]: values[path] ?? 0 };
  }
  const rate = values["load.frequency"] ?? 0;
  const harmonic = (/** @type {Record<string, number>} */ n) => (n.mean ?? 0) + (n.amplitude ?? 0) * Math.sin((n.order ?? 1) * rate * time + (n.phase ?? 0));
  return Object.values(terms).reduce((sum, term) => sum + harmonic(term), 0);
}
