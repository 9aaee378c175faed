/** On which cycle a motion ends: its states at the ends of forcing periods are compared until they repeat themselves. */

/** @typedef {import("./types.js").Engine} Engine */
/** @typedef {{period: number, amplitude: number, section: number[], points: number[][]}} Cycle */

const CHUNK = 8; // forcing periods between two looks: a motion that has settled is seen after half of them in the mean
const LONGEST = 8; // periods of a cycle that is looked for
const REPEATS = 1e-8; // how near a state must come to itself for a new cycle
const REACHED = 1e-3; // how near it must come, twice, to a cycle that is known
const SAMPLES = 64; // of a forcing period, for the amplitude

export class Settling {
  /** @param {Engine} engine @param {import("./types.js").Description} description */
  constructor(engine, description) {
    this.engine = engine;
    this.names = description.model.coordinates.map(({ name }) => name);
    this.rates = description.model.coordinates.map(({ velocity }) => velocity);
    /** @type {Cycle[]} */
    this.known = [];
    this.of = "";
  }

  /** @param {{cells: number[], values: Record<string, number>, starts: Float64Array, periods: number}} asked */
  cells({ cells, values, starts, periods }) {
    const key = JSON.stringify(values);
    if (key !== this.of) this.known = [];
    this.of = key;
    const system = this.engine.system(values);
    const size = 2 * this.names.length;
    const found = cells.map((_, i) => this.end(system, Array.from(starts.subarray(i * size, (i + 1) * size)), periods));
    return {
      cells, period: Int32Array.from(found, ({ period }) => period), amplitude: Float64Array.from(found, ({ amplitude }) => amplitude),
      section: Float64Array.from(found.flatMap(({ section }) => (section.length ? section : new Array(size).fill(NaN)))),
    };
  }

  /** The cycle on which a motion from a state ends; a period of -1 for none that is seen, -2 where the motion itself ends. @param {import("./types.js").EngineSystem} system @param {number[]} state @param {number} periods @returns {Cycle} */
  end(system, state, periods) {
    const period = system.period ?? 2 * Math.PI;
    /** @type {number[][]} */
    const past = [state];
    let now = state;
    for (let done = 0; done < periods; done += CHUNK) {
      let motion;
      try {
        motion = this.engine.simulate(system, this.started(now), CHUNK * period);
      } catch {
        return none(-2);
      }
      if (motion.stop !== "horizon" && motion.stop !== "rest") return none(-2);
      for (let k = 1; k <= CHUNK; k++) past.push(Array.from(motion.state(k === CHUNK ? motion.time.last : k * period)));
      now = /** @type {number[]} */ (past[past.length - 1]);
      const cycle = this.reached(past) ?? this.repeated(past, motion, period);
      if (cycle) return cycle;
    }
    return none(-1);
  }

  /** @param {number[]} state */
  started(state) {
    /** @type {Record<string, number>} */
    const start = { time: 0 };
    this.names.forEach((name, i) => {
      start[name] = state[i] ?? 0;
      start[this.rates[i] ?? ""] = state[i + this.names.length] ?? 0;
    });
    return start;
  }

  /** A known cycle that the last states follow. @param {number[][]} past */
  reached(past) {
    const [before, last] = past.slice(-2);
    if (!before || !last) return null;
    for (const cycle of this.known) {
      const at = cycle.points.findIndex((point) => apart(point, last) < REACHED);
      const earlier = cycle.points[(at - 1 + cycle.points.length) % cycle.points.length];
      if (at >= 0 && earlier && apart(earlier, before) < REACHED) return cycle;
    }
    return null;
  }

  /** A new cycle, if the last states repeat themselves. @param {number[][]} past @param {import("./types.js").Motion} motion @param {number} period */
  repeated(past, motion, period) {
    const last = past.length - 1;
    for (let q = 1; q <= LONGEST && 2 * q <= last; q++) {
      const near = (/** @type {number} */ k) => apart(/** @type {number[]} */ (past[last - k]), /** @type {number[]} */ (past[last - k - q])) < REPEATS;
      if (!Array.from({ length: q }, (_, k) => k).every(near)) continue;
      const points = past.slice(last - q + 1);
      const still = q === 1 && motion.stop === "rest";
      const section = /** @type {number[]} */ ([...points].sort(lexicographic)[0]);
      const cycle = { period: still ? 0 : q, amplitude: this.amplitude(motion, Math.min(q, CHUNK) * period), section, points };
      this.known.push(cycle);
      return cycle;
    }
    return null;
  }

  /** The largest size of any coordinate over the last `span` of a motion. @param {import("./types.js").Motion} motion @param {number} span */
  amplitude(motion, span) {
    const count = Math.ceil(span / (motion.time.last / CHUNK)) * SAMPLES;
    const times = new Float64Array(count + 1).map((_, i) => motion.time.last - span + (span * i) / count);
    const found = motion.sample(times);
    return this.names.reduce((most, name) => (found[name] ?? []).reduce((high, x) => Math.max(high, Math.abs(x)), most), 0);
  }
}

/** @param {number} period @returns {Cycle} */
function none(period) {
  return { period, amplitude: NaN, section: [], points: [] };
}

/** The largest difference of two states. @param {number[]} a @param {number[]} b */
function apart(a, b) {
  return a.reduce((most, x, i) => Math.max(most, Math.abs(x - (b[i] ?? NaN))), 0);
}

/** @param {number[]} a @param {number[]} b */
function lexicographic(a, b) {
  const first = a.findIndex((x, i) => Math.abs(x - (b[i] ?? NaN)) > REPEATS * 100);
  return first < 0 ? 0 : (a[first] ?? 0) - (b[first] ?? 0);
}
