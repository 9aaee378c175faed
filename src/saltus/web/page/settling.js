/** On which cycle a motion ends: its states at the ends of forcing periods are compared until they repeat themselves. */

/** @typedef {import("./types.js").Engine} Engine */
/** @typedef {{period: number, amplitude: number, section: number[], points: number[][]}} Cycle */

const CHUNK = 8; // forcing periods between two looks: a motion that has settled is seen after half of them in the mean
const LONGEST = 8; // periods of a cycle that is looked for
const REPEATS = 1e-8; // how near a state must come to itself for a new cycle
const REACHED = 1e-3; // how near it must come, twice, to a cycle that is known
const SAMPLES = 64; // of a forcing period, between which the largest is looked for
const NEARLY = 0.01; // Samples nearer than this share to the largest one may have the true one beside them.

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
      const cycle = { period: still ? 0 : q, amplitude: this.amplitude(motion, Math.min(q, CHUNK) * period, period), section, points };
      this.known.push(cycle);
      return cycle;
    }
    return null;
  }

  /** The largest size of any coordinate over the last `span` of a motion. @param {import("./types.js").Motion} motion @param {number} span @param {number} period */
  amplitude(motion, span, period) {
    return Math.max(...this.names.map((_, i) => amplitudeOf(motion, i, motion.time.last - span, period)));
  }
}

/**
 * The largest size of a coordinate from a time to the end of a motion: between samples by golden sections, about all samples that
 * are nearly the largest.
 * @param {import("./types.js").Motion} motion @param {number} coordinate @param {number} from @param {number} period
 */
export function amplitudeOf(motion, coordinate, from, period) {
  const { last } = motion.time;
  const count = Math.max(2, Math.ceil(((last - from) / period) * SAMPLES));
  const at = (/** @type {number} */ i) => from + ((last - from) * Math.min(Math.max(i, 0), count)) / count;
  const size = (/** @type {number} */ time) => Math.abs(motion.state(time)[coordinate] ?? NaN);
  const sizes = Array.from({ length: count + 1 }, (_, i) => size(at(i)));
  const most = sizes.reduce((high, x) => Math.max(high, x), 0);
  const high = sizes.flatMap((x, i) => (x > (1 - NEARLY) * most && x >= (sizes[i - 1] ?? 0) && x >= (sizes[i + 1] ?? 0) ? [i] : []));
  return high.reduce((best, i) => Math.max(best, sizes[i] ?? 0, golden(size, at(i - 1), at(i + 1))), most);
}

/** The largest value between two places, of a function with one maximum between them. @param {(x: number) => number} f @param {number} low @param {number} high */
function golden(f, low, high) {
  const share = (Math.sqrt(5) - 1) / 2;
  let [a, b] = [high - share * (high - low), low + share * (high - low)];
  let [before, after] = [f(a), f(b)];
  while (b - a > 1e-9 * (1 + Math.abs(b))) {
    if (before > after) {
      [high, b, after] = [b, a, before];
      a = high - share * (high - low);
      before = f(a);
    } else {
      [low, a, before] = [a, b, after];
      b = low + share * (high - low);
      after = f(b);
    }
  }
  return Math.max(before, after);
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
