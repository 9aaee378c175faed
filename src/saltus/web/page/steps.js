/** The Taylor series of every step of a motion. */

import { placeAbove } from "./load_table.js";

/** @param {Float64Array} coefficients @param {number} from @param {number} length @param {number} tau */
function horner(coefficients, from, length, tau) {
  let value = coefficients[from + length - 1];
  for (let k = length - 2; k >= 0; k--) value = value * tau + coefficients[from + k];
  return value;
}

/** @param {Float64Array} coefficients @param {number} from @param {number} length @param {number} tau */
function hornerSlope(coefficients, from, length, tau) {
  let value = coefficients[from + length - 1] * (length - 1);
  for (let k = length - 2; k >= 1; k--) value = value * tau + coefficients[from + k] * k;
  return value;
}

/** The Taylor series of every step. */
export class Steps {
  /** @param {number} dof @param {number} terms @param {number} length */
  constructor(dof, terms, length) {
    this.dof = dof;
    this.terms = terms;
    this.length = length;
    this.count = 0;
    /** @type {Float64Array[]} */
    this.pieces = [];
    this.series = new Float64Array(0);
    /** @type {number[]} */
    this.starts = [];
    /** @type {number[]} */
    this.lengths = [];
    /** @type {number[]} */
    this.sides = [];
  }

  /** @param {number} count @param {BigInt64Array} labels @param {Float64Array} spans @param {Float64Array} series */
  add(count, labels, spans, series) {
    for (let i = 0; i < count; i++) {
      this.starts.push(Number(labels[2 * i]) * this.length + spans[2 * i]);
      this.lengths.push(spans[2 * i + 1]);
      this.sides.push(Number(labels[2 * i + 1]));
    }
    this.count += count;
    this.pieces.push(series.slice());
  }

  settle() {
    const size = this.pieces.reduce((n, piece) => n + piece.length, 0);
    this.series = new Float64Array(size);
    let at = 0;
    for (const piece of this.pieces) {
      this.series.set(piece, at);
      at += piece.length;
    }
    this.pieces = [];
  }

  /** The step in which a time lies; after the last one the last. @param {number} time */
  at(time) {
    return Math.max(placeAbove(this.starts, time) - 1, 0);
  }

  /** Coordinates, velocities and accelerations in a step. @param {number} step @param {number} tau */
  withAccelerations(step, tau) {
    const { dof, terms, series } = this;
    const state = new Float64Array(3 * dof);
    for (let i = 0; i < dof; i++) {
      const from = (step * dof + i) * terms;
      state[i] = horner(series, from, terms, tau);
      state[dof + i] = hornerSlope(series, from, terms, tau);
      for (let k = terms - 1; k >= 2; k--) state[2 * dof + i] = state[2 * dof + i] * tau + series[from + k] * k * (k - 1);
    }
    return state;
  }

  /**
   * Coordinates and velocities at many times, into a list for each. Times that grow are found by going on from step to step.
   * @param {ArrayLike<number>} times @param {number} last from this time on the state is `end` @param {ArrayLike<number>} end @param {Float64Array[]} lists
   */
  sample(times, last, end, lists) {
    const { dof, terms, series, starts, count } = this;
    let step = 0;
    for (let i = 0; i < times.length; i++) {
      const time = times[i];
      if (time >= last || !count) {
        for (let k = 0; k < 2 * dof; k++) lists[k][i] = end[k];
        continue;
      }
      if (time < starts[step]) step = this.at(time);
      while (step + 1 < count && starts[step + 1] <= time) step++;
      const tau = time - starts[step];
      for (let k = 0; k < dof; k++) {
        const from = (step * dof + k) * terms;
        const highest = series[from + terms - 1];
        let [value, slope] = [highest, highest * (terms - 1)];
        for (let n = terms - 2; n >= 1; n--) {
          const coefficient = series[from + n];
          value = value * tau + coefficient;
          slope = slope * tau + coefficient * n;
        }
        lists[k][i] = value * tau + series[from];
        lists[dof + k][i] = slope;
      }
    }
  }

  /** Coordinates, then velocities, at a time. @param {number} time */
  state(time) {
    const step = this.at(time);
    const tau = time - this.starts[step];
    const state = new Float64Array(2 * this.dof);
    for (let i = 0; i < this.dof; i++) {
      const from = (step * this.dof + i) * this.terms;
      state[i] = horner(this.series, from, this.terms, tau);
      state[this.dof + i] = hornerSlope(this.series, from, this.terms, tau);
    }
    return state;
  }
}
