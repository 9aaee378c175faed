/** Basins of attraction that refine while one looks: cells of the phase plane, followed in workers, from coarse to fine. */

/** @typedef {import("./session.js").Session} Session */
/**
 * @typedef {{postMessage: (message: any) => void, terminate: () => void,
 *   onmessage: ((event: {data: any}) => void)|null, onerror?: ((event: any) => void)|null}} WorkerLike
 */
/** @typedef {{name: string, period: number, amplitude: number, section: number[], cells: number}} Attractor */

export const BASIN_GRID = 200; // cells along each side
const STRIDES = [16, 8, 4, 2, 1]; // from coarse to fine
const BATCH = 96; // cells that a worker gets at a time: a message each few milliseconds
const SAME = 1e-5; // of the window's size: sections nearer than this are one attractor's
const [UNSEEN, UNDECIDED, ENDED] = [-3, -1, -2];

export class Basins {
  /**
   * @param {Session} session @param {() => WorkerLike} makeWorker @param {{wasm: Uint8Array|null, description: any}} opening
   * @param {(basins: Basins) => void} tell
   */
  constructor(session, makeWorker, opening, tell) {
    this.session = session;
    this.makeWorker = makeWorker;
    this.opening = opening;
    this.tell = tell;
    /** @type {WorkerLike[]} */
    this.workers = [];
    /** @type {Attractor[]} */
    this.attractors = [];
    this.labels = new Int16Array(0);
    /** @type {number[]} */
    this.window = [0, 1, 0, 1];
    this.counted = 0;
    this.done = true;
    this.refusal = "";
    /** @type {number[]} */
    this.queue = [];
    this.next = 0;
    this.periods = 0;
  }

  /** @param {number[]} window_ @param {number} periods */
  start(window_, periods) {
    this.stop();
    this.window = window_;
    this.labels = new Int16Array(BASIN_GRID * BASIN_GRID).fill(UNSEEN);
    this.attractors = [];
    this.counted = 0;
    this.done = false;
    this.refusal = "";
    this.periods = periods;
    this.queue = order();
    this.next = 0;
    const count = Math.max(1, Math.min((globalThis.navigator?.hardwareConcurrency ?? 2), 8));
    this.workers = Array.from({ length: count }, () => this.opened());
    this.tell(this);
  }

  stop() {
    for (const worker of this.workers) worker.terminate();
    this.workers = [];
    this.done = true;
  }

  opened() {
    const worker = this.makeWorker();
    worker.onmessage = ({ data }) => this.heard(worker, data);
    worker.onerror = (event) => this.failed(event?.message ?? "a worker could not be started");
    worker.postMessage({ kind: "open", ...this.opening });
    return worker;
  }

  /** @param {string} message */
  failed(message) {
    this.refusal = String(message);
    this.stop();
    this.tell(this);
  }

  /** @param {WorkerLike} worker @param {any} data */
  heard(worker, data) {
    if (this.done) return;
    if (data.error) return this.failed(data.error);
    if (data.cells) this.take(data);
    this.give(worker);
  }

  /** @param {WorkerLike} worker */
  give(worker) {
    const { queue } = this;
    const cells = queue.slice(this.next, this.next + BATCH);
    if (!cells.length) {
      if (this.counted >= queue.length) this.finish();
      return;
    }
    this.next = this.next + cells.length;
    const { store, coordinates } = this.session;
    const { values, coordinate } = store.state;
    const size = 2 * coordinates.length;
    const starts = new Float64Array(cells.length * size);
    cells.forEach((cell, i) => {
      coordinates.forEach(({ name, velocity }, k) => {
        starts[i * size + k] = store.state.start[name] ?? 0;
        starts[i * size + coordinates.length + k] = store.state.start[velocity] ?? 0;
      });
      const { x, y } = this.centre(cell);
      starts[i * size + coordinate] = x;
      starts[i * size + coordinates.length + coordinate] = y;
    });
    worker.postMessage({ kind: "cells", cells, values, starts, periods: this.periods });
  }

  /** The middle of a cell in the plane. @param {number} cell */
  centre(cell) {
    const [x0, x1, y0, y1] = /** @type {[number, number, number, number]} */ (this.window);
    const [column, row] = [cell % BASIN_GRID, Math.floor(cell / BASIN_GRID)];
    return { x: x0 + ((column + 0.5) / BASIN_GRID) * (x1 - x0), y: y0 + ((row + 0.5) / BASIN_GRID) * (y1 - y0) };
  }

  /** @param {{cells: number[], period: Int32Array, amplitude: Float64Array, section: Float64Array}} data */
  take(data) {
    const size = data.section.length / Math.max(data.cells.length, 1);
    data.cells.forEach((cell, i) => {
      const period = data.period[i] ?? UNDECIDED;
      const section = Array.from(data.section.subarray(i * size, (i + 1) * size));
      this.labels[cell] = period < 0 ? period : this.labelOf(period, data.amplitude[i] ?? 0, section);
    });
    this.counted += data.cells.length;
    this.tell(this);
  }

  /** The attractor with this section, or a new one. @param {number} period @param {number} amplitude @param {number[]} section */
  labelOf(period, amplitude, section) {
    const [x0, x1, y0, y1] = /** @type {[number, number, number, number]} */ (this.window);
    const apart = SAME * Math.max(x1 - x0, y1 - y0, 1);
    const near = (/** @type {Attractor} */ a) => a.period === period && a.section.every((value, i) => Math.abs(value - (section[i] ?? 0)) < apart);
    let label = this.attractors.findIndex(near);
    if (label < 0) {
      const name = period === 0 ? "rest" : this.session.period ? `period ${period}, amplitude ${Number(amplitude.toPrecision(4))}` : this.equilibrium(section);
      label = this.attractors.push({ name, period, amplitude, section, cells: 0 }) - 1;
    }
    /** @type {Attractor} */ (this.attractors[label]).cells++;
    return label;
  }

  /** @param {number[]} section */
  equilibrium(section) {
    const where = this.session.coordinates.map(({ name }, i) => `${name} = ${Number((section[i] ?? NaN).toPrecision(4))}`);
    return `equilibrium, ${where.join(", ")}`;
  }

  finish() {
    this.stop();
    this.tell(this);
  }

  /** The share of cells that are undecided or ended. */
  open() {
    const undecided = this.labels.reduce((sum, label) => sum + (label === UNDECIDED ? 1 : 0), 0);
    const ended = this.labels.reduce((sum, label) => sum + (label === ENDED ? 1 : 0), 0);
    return { undecided, ended };
  }

  /** The label at a point: an attractor's number, or null. @param {number} x @param {number} y */
  at(x, y) {
    const [x0, x1, y0, y1] = /** @type {[number, number, number, number]} */ (this.window);
    const [column, row] = [Math.floor(((x - x0) / (x1 - x0)) * BASIN_GRID), Math.floor(((y - y0) / (y1 - y0)) * BASIN_GRID)];
    if (column < 0 || row < 0 || column >= BASIN_GRID || row >= BASIN_GRID) return null;
    return this.known(column, row);
  }

  /** The label of a cell, or of the coarser one that it lies in. @param {number} column @param {number} row */
  known(column, row) {
    for (const stride of [...STRIDES].reverse()) {
      const [c, r] = [column - (column % stride), row - (row % stride)];
      const label = this.labels[r * BASIN_GRID + c] ?? UNSEEN;
      if (label !== UNSEEN) return label;
    }
    return null;
  }

  /** The picture as pixels, one for a cell. @param {string[]} colors @param {string} undecided */
  image(colors, undecided) {
    const canvas = document.createElement("canvas");
    canvas.width = canvas.height = BASIN_GRID;
    const ctx = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    const picture = ctx.createImageData(BASIN_GRID, BASIN_GRID);
    const [open, ...inks] = [undecided, ...colors].map(channels);
    for (let row = 0; row < BASIN_GRID; row++) {
      for (let column = 0; column < BASIN_GRID; column++) {
        const label = this.known(column, row);
        if (label === null) continue;
        const ink = (label < 0 ? open : inks[label % inks.length]) ?? [0, 0, 0];
        picture.data.set([...ink, 255], 4 * ((BASIN_GRID - 1 - row) * BASIN_GRID + column));
      }
    }
    ctx.putImageData(picture, 0, 0);
    return canvas;
  }
}

/** Red, green and blue of a colour that is written as #rrggbb. @param {string} color */
function channels(color) {
  return [1, 3, 5].map((at) => Number.parseInt(color.slice(at, at + 2), 16) || 0);
}

/** All cells, those of the coarse grids first, and within a grid spread over the plane. */
function order() {
  /** @type {number[]} */
  const cells = [];
  const seen = new Uint8Array(BASIN_GRID * BASIN_GRID);
  for (const stride of STRIDES) {
    for (let row = 0; row < BASIN_GRID; row += stride) {
      for (let column = 0; column < BASIN_GRID; column += stride) {
        const cell = row * BASIN_GRID + column;
        if (!seen[cell]) cells.push(cell);
        seen[cell] = 1;
      }
    }
  }
  return cells;
}
