/**
 * A sweep as in a laboratory: the amplitude of the settled motion against a parameter, up and then down, the motion carried along.
 * It is computed in slices between pictures, so that the page stays alive, and a jump is where the amplitude leaps.
 */

import { goesOn } from "./description.js";
import { amplitudeOf } from "./settling.js";

/** @typedef {import("./session.js").Session} Session */

const SLICE = 10; // milliseconds of work between two pictures
const WATCHED = 4; // periods at the end of each value over which the amplitude is taken
const LEAP = 5; // times the usual change from value to value: more is a jump
const LEAST_LEAP = 0.02; // of the largest amplitude

/** @typedef {{value: number, amplitude: number, state: number[], stop: string}} SweepPoint */
/** @typedef {{up: SweepPoint[], down: SweepPoint[], done: boolean, refusal: string}} SweepResult */

export class Sweep {
  /** @param {Session} session @param {(result: SweepResult) => void} tell */
  constructor(session, tell) {
    this.session = session;
    this.tell = tell;
    /** @type {SweepResult} */
    this.result = { up: [], down: [], done: true, refusal: "" };
    this.running = 0;
  }

  stop() {
    this.running++;
    this.result = { ...this.result, done: true };
    this.tell(this.result);
  }

  /** Begin anew, from the numbers of the page. */
  async start() {
    const ticket = ++this.running;
    const { store, engine } = this.session;
    const { values, start, sweep, coordinate } = store.state;
    this.result = { up: [], down: [], done: false, refusal: "" };
    if (!goesOn(this.session.description)) {
      this.result = { ...this.result, done: true, refusal: "a sweep needs a load that repeats itself or is constant" };
      return this.tell(this.result);
    }
    const steps = Math.max(2, Math.round(sweep.count));
    const along = Array.from({ length: steps }, (_, i) => sweep.low + ((sweep.high - sweep.low) * i) / (steps - 1));
    /** @type {Record<string, number>} */
    let state = { ...start, time: 0 };
    let from = performance.now();
    try {
      for (const [name, list] of /** @type {const} */ ([["up", along], ["down", [...along].reverse()]])) {
        for (const value of list) {
          const refused = this.session.refusalOf({ ...values, [sweep.path]: value });
          if (refused) throw new Error(refused.message);
          const point = settled(this.session, engine, { ...values, [sweep.path]: value }, state, sweep.periods, coordinate);
          state = point.next;
          this.result[name].push({ value, amplitude: point.amplitude, state: point.state, stop: point.stop });
          if (performance.now() - from < SLICE) continue;
          this.tell(this.result);
          await new Promise((resolve) => setTimeout(resolve, 0));
          if (ticket !== this.running) return;
          from = performance.now();
        }
      }
    } catch (error) {
      this.result.refusal = /** @type {any} */ (error)?.message ?? String(error);
    }
    this.result = { ...this.result, done: true };
    this.tell(this.result);
  }
}

/**
 * The motion after so many periods from a state: its amplitude, and the state at its end.
 * @param {Session} session @param {import("./types.js").Engine} engine @param {Record<string, number>} values
 * @param {Record<string, number>} start @param {number} periods @param {number} coordinate
 */
function settled(session, engine, values, start, periods, coordinate) {
  const system = engine.system(values);
  const period = system.period ?? 2 * Math.PI;
  const motion = engine.simulate(system, start, periods * period, system.period ? { periods } : {});
  const { first, last } = motion.time;
  const state = Array.from(motion.state(last));
  /** @type {Record<string, number>} */
  const next = { time: 0 };
  session.coordinates.forEach((each, i) => {
    next[each.name] = state[i] ?? 0;
    next[each.velocity] = state[i + session.coordinates.length] ?? 0;
  });
  const ended = motion.stop !== "horizon" && motion.stop !== "rest";
  const amplitude = ended ? NaN : amplitudeOf(motion, coordinate, Math.max(first, last - WATCHED * period), period);
  return { amplitude, state, stop: motion.stop, next: ended ? start : next };
}

/** The places between two values at which the amplitude jumps. @param {SweepPoint[]} points */
export function jumpsOf(points) {
  const changes = points.slice(1).map((point, i) => Math.abs(point.amplitude - (points[i]?.amplitude ?? NaN)));
  const usual = [...changes].filter(Number.isFinite).sort((a, b) => a - b)[Math.floor(changes.length / 2)] ?? 0;
  const most = points.reduce((high, point) => Math.max(high, point.amplitude || 0), 0);
  const least = Math.max(LEAP * usual, LEAST_LEAP * most);
  return changes.flatMap((change, i) => (change > least ? [{ from: points[i], to: points[i + 1] }] : []));
}
