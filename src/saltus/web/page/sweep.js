/**
 * A sweep as in a laboratory: the amplitude of the settled motion against a parameter, up and then down, the motion carried along.
 * It is computed in slices between pictures, so that the page stays alive. A jump is a change of the amplitude that stays in ever smaller steps.
 */

import { goesOn } from "./description.js";
import { amplitudeOf } from "./settling.js";

/** @typedef {import("./session.js").Session} Session */

const SLICE = 10; // milliseconds of work between two pictures
const WATCHED = 4; // periods at the end of each value over which the amplitude is taken
const LEAST_LEAP = 0.02; // of the largest amplitude: what a jump changes at least
const DIFFERENT = 0.01; // of the largest amplitude: by more the ways up and down are on two motions
const JUMP_HALVINGS = 8; // of a step between two values, in which a smooth change becomes small and a jump stays
const MORE_TIMES = 3; // a motion that has not settled is followed for as long again
const STEADY = 0.01; // of its amplitude: what a motion that has settled changes at most from some periods to the next

/** @typedef {{value: number, amplitude: number, state: number[], stop: string, steady: boolean}} SweepPoint */
/** @typedef {{way: "up"|"down", from: SweepPoint, to: SweepPoint}} Jump */
/** @typedef {(value: number, state: Record<string, number>) => {point: SweepPoint, ended: boolean}} Settle */
/** @typedef {{up: SweepPoint[], down: SweepPoint[], jumps: Jump[], done: boolean, refusal: string}} SweepResult */

export class Sweep {
  /** @param {Session} session @param {(result: SweepResult) => void} tell */
  constructor(session, tell) {
    this.session = session;
    this.tell = tell;
    /** @type {SweepResult} */
    this.result = { up: [], down: [], jumps: [], done: true, refusal: "" };
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
    this.result = { up: [], down: [], jumps: [], done: false, refusal: "" };
    if (!goesOn(this.session.description)) {
      this.result = { ...this.result, done: true, refusal: "a sweep needs a load that repeats itself or is constant" };
      return this.tell(this.result);
    }
    const steps = Math.max(2, Math.round(sweep.count));
    const along = Array.from({ length: steps }, (_, i) => sweep.low + ((sweep.high - sweep.low) * i) / (steps - 1));
    const settle = (/** @type {number} */ value, /** @type {Record<string, number>} */ state) => {
      const refused = this.session.refusalOf({ ...values, [sweep.path]: value });
      if (refused) throw new Error(refused.message);
      const follow = (/** @type {Record<string, number>} */ begin) => settled(engine, value, { ...values, [sweep.path]: value }, begin, sweep.periods, coordinate);
      let found = follow(state);
      // beside a jump motions settle slowly
      for (let k = 0; k < MORE_TIMES && !found.point.steady && !found.ended; k++) found = follow(named(this.session, found.point.state));
      return found;
    };
    let from = performance.now();
    const isCurrent = async () => {
      if (performance.now() - from < SLICE) return true;
      this.tell(this.result);
      await new Promise((resolve) => setTimeout(resolve, 0));
      from = performance.now();
      return ticket === this.running;
    };
    try {
      /** @type {Record<string, number>} */
      let state = { ...start, time: 0 };
      for (const [name, list] of /** @type {const} */ ([["up", along], ["down", [...along].reverse()]])) {
        for (const value of list) {
          const { point, ended } = settle(value, state);
          if (!ended) state = named(this.session, point.state);
          this.result[name].push(point);
          if (!(await isCurrent())) return;
        }
      }
      if (!(await this.findJumps(settle, isCurrent))) return;
    } catch (error) {
      this.result.refusal = /** @type {any} */ (error)?.message ?? String(error);
    }
    this.result = { ...this.result, done: true };
    this.tell(this.result);
  }

  /**
   * Find the jumps between the values; false once the sweep was begun anew.
   * @param {Settle} settle @param {() => Promise<boolean>} isCurrent
   */
  async findJumps(settle, isCurrent) {
    const { up, down, jumps } = this.result;
    const most = Math.max(...[...up, ...down].map(({ amplitude }) => amplitude || 0));
    const [least, different] = [LEAST_LEAP * most, DIFFERENT * most];
    const between = (/** @type {SweepPoint} */ from, /** @type {SweepPoint} */ to, begin = from) => settle((from.value + to.value) / 2, named(this.session, begin.state)).point;
    for (const [way, own, other] of /** @type {const} */ ([["up", up, down], ["down", down, up]])) {
      for (const step of changesOf(own, least)) {
        for (let k = 0; k < JUMP_HALVINGS && step.change > least; k++) {
          const middle = between(step.from, step.to);
          if (!(await isCurrent())) return false;
          if (!middle.steady) break; // too near to the jump to settle
          halve(step, middle);
        }
        if (step.change > least) jumps.push({ way, from: step.from, to: step.to });
      }
      // a jump may hide in a small change, where the amplitude has risen before it falls
      for (const step of endsOfLoops(own, other, different)) {
        const inside = (/** @type {Jump} */ jump) => jump.way === way && (jump.from.value - step.from.value) * (jump.to.value - step.to.value) <= 0;
        if (jumps.some(inside)) continue;
        for (let k = 0; k < JUMP_HALVINGS; k++) {
          const [middle, joined] = [between(step.from, step.to), between(step.from, step.to, step.to)];
          if (!(await isCurrent())) return false;
          if (!middle.steady || !joined.steady) break;
          if (Math.abs(middle.amplitude - joined.amplitude) > different) step.from = middle;
          else step.to = middle;
        }
        jumps.push({ way, from: step.from, to: step.to });
      }
    }
    return true;
  }
}

/** The state at the start of a motion, by the names of its variables. @param {Session} session @param {number[]} state */
function named(session, state) {
  /** @type {Record<string, number>} */
  const start = { time: 0 };
  session.coordinates.forEach((each, i) => {
    start[each.name] = state[i] ?? 0;
    start[each.velocity] = state[i + session.coordinates.length] ?? 0;
  });
  return start;
}

/**
 * The motion after so many periods from a state: its amplitude, the state at its end, and whether it has settled.
 * @param {import("./types.js").Engine} engine @param {number} value @param {Record<string, number>} values
 * @param {Record<string, number>} start @param {number} periods @param {number} coordinate @returns {{point: SweepPoint, ended: boolean}}
 */
function settled(engine, value, values, start, periods, coordinate) {
  const system = engine.system(values);
  const period = system.period ?? 2 * Math.PI;
  const motion = engine.simulate(system, start, periods * period, system.period ? { periods } : {});
  const { first, last } = motion.time;
  const state = Array.from(motion.state(last));
  const ended = motion.stop !== "horizon" && motion.stop !== "rest";
  const watched = (/** @type {number} */ before) => amplitudeOf(motion, coordinate, Math.max(first, last - before * WATCHED * period), period);
  const amplitude = ended ? NaN : watched(1);
  const steady = !ended && watched(2) - amplitude <= STEADY * amplitude;
  return { point: { value, amplitude, state, stop: motion.stop, steady }, ended };
}

/** @typedef {{from: SweepPoint, to: SweepPoint, change: number}} Step */

/** How much the amplitude changes between two motions that have settled, else 0. @param {SweepPoint} from @param {SweepPoint} to */
const changed = (from, to) => (from.steady && to.steady ? Math.abs(to.amplitude - from.amplitude) : 0);

/** The steps of a sweep in which the amplitude changes by more than a jump does at least. @param {SweepPoint[]} points @param {number} least @returns {Step[]} */
export function changesOf(points, least) {
  const steps = points.slice(1).map((to, i) => {
    const from = /** @type {SweepPoint} */ (points[i]);
    return { from, to, change: changed(from, to) };
  });
  return steps.filter(({ change }) => change > least);
}

/** Replace a step by the half in which the amplitude changes more. @param {Step} step @param {SweepPoint} middle the motion between, begun from the first one */
export function halve(step, middle) {
  const before = changed(step.from, middle);
  const behind = changed(middle, step.to);
  if (before > behind) step.to = middle;
  else step.from = middle;
  step.change = Math.max(before, behind);
}

/**
 * The steps in which a sweep leaves the motion of its own and joins that of the way back: before they differ, and behind they agree.
 * @param {SweepPoint[]} own @param {SweepPoint[]} other the way back, whose values are in the other order @param {number} different
 */
export function endsOfLoops(own, other, different) {
  const back = [...other].reverse();
  const apart = own.map((point, i) => Math.abs(point.amplitude - (back[i]?.amplitude ?? NaN)) > different);
  return own.slice(1).flatMap((to, i) => {
    const from = /** @type {SweepPoint} */ (own[i]);
    return apart[i] && !apart[i + 1] && from.steady && to.steady ? [{ from, to }] : [];
  });
}
