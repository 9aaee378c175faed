/** A motion from its first instant to its last one: its states, events, margins and energy, under Python's names. */

import { general } from "./python_numbers.js";

/** @typedef {import("./run.js").PageEvent} PageEvent */
/** @typedef {import("./steps.js").Steps} Steps */
/** @typedef {{first: Record<string, number|null>, share: Record<string, number>}} Validity */

const STEP_SAMPLES = 12; // in each step, to find changes of sign: as many as Python takes
const HALVINGS = 60; // of a bracket of a change of sign: to rounding

export class PageMotion {
  /** @param {import("./run.js").Run} run @param {Steps} steps @param {PageEvent[]} events @param {number} status @param {boolean} unfinished whether the page gave up, not the kernel */
  constructor(run, steps, events, status, unfinished) {
    const { engine } = run;
    const { layout, dof } = engine;
    const { Mode, Status } = layout;
    const record = engine.record();
    this.system = run.system;
    this.steps = steps;
    this.events = events;
    this.time = { first: run.first, last: record.get("period") * record.get("period_length") + record.get("time") };
    this.end = engine.doubles(engine.address("state"), 2 * dof).slice();
    const mode = record.get("mode");
    this.chatter = mode === Mode.CHATTER ? record.get("chatter_speed") : null;
    const resting = mode === Mode.REST || mode === Mode.CHATTER;
    this.side = !engine.several && resting ? 0 : record.get("side");
    this.stop = mode === Mode.REST ? "rest" : "horizon";
    if (unfinished) this.stop = "unfinished";
    else if (status !== Status.DONE) this.stop = layout.stops[status] ?? "not_finite";
    this.limit = status === Status.LIMITED ? (events.at(-1)?.contact ?? "") : "";
    const sentence = layout.refusals[status] ?? "";
    this.reason = sentence && sentence.replaceAll("{time}", general(this.time.last, 9)).replaceAll("{velocity}", general(this.end[dof] ?? NaN));
    this.meaning = unfinished ? "the page follows a motion for no more than two seconds of computing" : (layout.stop_meanings[this.stop] ?? "");
    this.names = [...engine.names, ...engine.rates];
    /** @type {Validity|null} */
    this.checked = null;
  }

  /** Coordinates, then velocities; at an impact those after it. @param {number} time */
  state(time) {
    if (time >= this.time.last || !this.steps.count) return this.end.slice();
    return this.steps.state(time);
  }

  /** The side of the contact at a time, 0 at rest; with several contacts Python's number of what is closed. @param {number} time */
  sideAt(time) {
    if (time >= this.time.last || !this.steps.count) return this.side;
    return this.steps.sides[this.steps.at(time)] ?? 0;
  }

  /** States at many times, by the names of the variables. @param {ArrayLike<number>} times */
  sample(times) {
    /** @type {Record<string, Float64Array>} */
    const columns = { time: Float64Array.from(times) };
    const lists = this.names.map((name) => (columns[name] = new Float64Array(times.length)));
    this.steps.sample(times, this.time.last, this.end, lists);
    return columns;
  }

  /** What can be evaluated at a time within a step. @param {number} step @param {number} tau since the start of the step */
  evaluated(step, tau) {
    const { system, steps } = this;
    const side = system.engine.several ? 1 : steps.sides[step] || 1; // at rest on both sides alike
    return system.engine.evaluated(system, (steps.starts[step] ?? 0) + tau, side, steps.withAccelerations(step, tau));
  }

  /** Where a time is: the step, and the time since its start. @param {number} time @returns {[number, number]} */
  within(time) {
    const step = this.steps.at(time);
    return [step, Math.min(time, this.time.last) - (this.steps.starts[step] ?? 0)];
  }

  /** The names of the margins that the page can compute. */
  get marginNames() {
    const { margins, energy } = this.system.engine.layout;
    return energy ? margins.slice(0, -1) : margins;
  }

  /** The margins of the model at a time, by their names; null at rest, and where there is nothing to evaluate. @param {number} time */
  margins(time) {
    const names = this.marginNames;
    const [step, tau] = this.within(time);
    if (!names.length || !this.steps.count || this.steps.sides[step] === 0) return null;
    const values = this.evaluated(step, tau);
    return Object.fromEntries(names.map((name, i) => [name, values[i] ?? NaN]));
  }

  /** The kinetic energy at a time; null where the model has none. @param {number} time */
  energy(time) {
    if (!this.system.engine.layout.energy || !this.steps.count) return null;
    return this.evaluated(...this.within(time)).at(-1) ?? null;
  }

  /** When each margin is first passed, and for what share of the time: as Python's `Validity`, found when it is asked for. */
  get validity() {
    this.checked ??= this.check();
    return this.checked;
  }

  /** @returns {Validity} */
  check() {
    const { steps, time } = this;
    const names = this.marginNames;
    const first = names.map(() => /** @type {number|null} */ (null));
    const beyond = names.map(() => 0);
    const moving = names.length ? steps.starts.keys() : [];
    for (const step of moving) {
      const length = steps.lengths[step] ?? 0;
      if (steps.sides[step] === 0 || !(length > 0)) continue;
      let [at, before] = [0, this.evaluated(step, 0).slice()];
      for (let k = 1; k <= STEP_SAMPLES; k++) {
        const tau = (length * k) / STEP_SAMPLES;
        const now = this.evaluated(step, tau).slice();
        names.forEach((_, i) => {
          const [was, is] = [(before[i] ?? 0) < 0, (now[i] ?? 0) < 0];
          if (!was && !is) return;
          const change = was === is ? tau : this.change(step, i, at, tau, was);
          const [from, to] = was ? [at, change] : [change, tau];
          beyond[i] = (beyond[i] ?? 0) + to - from;
          first[i] ??= (steps.starts[step] ?? 0) + from;
        });
        [at, before] = [tau, now];
      }
    }
    const duration = time.last - time.first;
    return {
      first: Object.fromEntries(names.map((name, i) => [name, first[i] ?? null])),
      share: Object.fromEntries(names.map((name, i) => [name, duration ? (beyond[i] ?? 0) / duration : 0])),
    };
  }

  /** When a margin changes its sign between two times of a step. @param {number} step @param {number} i @param {number} low @param {number} high @param {boolean} negative whether it is so at the first */
  change(step, i, low, high, negative) {
    for (let k = 0; k < HALVINGS && high > low; k++) {
      const middle = (low + high) / 2;
      if (middle === low || middle === high) break;
      if ((this.evaluated(step, middle)[i] ?? 0) < 0 === negative) low = middle;
      else high = middle;
    }
    return (low + high) / 2;
  }
}
