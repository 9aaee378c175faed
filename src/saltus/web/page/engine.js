// @ts-nocheck: the types of what the memory holds are those of the tables that Python writes.
// The engine of the page: packs a system into the memory of the kernel, runs it, and reads motions out of it.
//
// All equations are in the WebAssembly that Python made of the model: this file knows no model. Where a number lies in memory, and
// what the numbers of events, modes and reasons mean, it reads from tables of `description.engine`, which Python makes from the
// types with which the kernel is compiled. Names are Python's.

/**
 * @typedef {{name: string, kind: string, dimensions: number, whole?: boolean, size?: number}} Argument
 * @typedef {{[name: string]: any}} Description
 * @typedef {{time: number, kind: string, contact: string, side: number, before: number[], after: number[], impulse: number[]}} MotionEvent
 */

const BUFFER = 1024; // steps, and events, that one call of the kernel may record
const MOST_EVENTS = 200000; // of a motion that is drawn
const MOST_STEPS = 2000000;

/** What Python would refuse, with its sentence. */
export class Refusal extends Error {
  /**
   * @param {string} where the dotted path, or the name of the argument
   * @param {string} message
   */
  constructor(where, message) {
    super(message);
    this.name = "Refusal";
    this.where = where;
  }
}

/**
 * @param {Uint8Array | ArrayBuffer} wasm
 * @param {Description} description
 */
export async function open(wasm, description) {
  const made = await WebAssembly.instantiate(/** @type {any} */ (wasm), {});
  return new Engine(/** @type {any} */ (made).instance ?? made, description);
}

/** @param {number} value @param {number} unit the quotient, rounded down, and the remainder, as Python's divmod */
export function divmod(value, unit) {
  let rest = value % unit;
  if (rest !== 0 && rest < 0 !== unit < 0) rest += unit;
  const quotient = (value - rest) / unit;
  const floor = Math.floor(quotient);
  return [quotient - floor > 0.5 ? floor + 1 : floor, rest];
}

/** Python's f"{value:.{digits}g}" @param {number} value @param {number} digits */
export function general(value, digits = 6) {
  if (Number.isNaN(value)) return "nan";
  if (!Number.isFinite(value)) return value < 0 ? "-inf" : "inf";
  if (value === 0) return Object.is(value, -0) ? "-0" : "0";
  const [mantissa, power] = value.toExponential(digits - 1).split("e");
  const exponent = Number(power);
  if (exponent < -4 || exponent >= digits) {
    const short = mantissa.includes(".") ? mantissa.replace(/\.?0+$/, "") : mantissa;
    return `${short}e${exponent < 0 ? "-" : "+"}${String(Math.abs(exponent)).padStart(2, "0")}`;
  }
  const fixed = value.toFixed(Math.max(0, digits - 1 - exponent));
  return fixed.includes(".") ? fixed.replace(/\.?0+$/, "") : fixed;
}

/** Python's repr of a float @param {number} value */
export function plain(value) {
  if (!Number.isFinite(value)) return general(value);
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-4 || size >= 1e16)) {
    const [mantissa, power] = value.toExponential().split("e");
    const exponent = Number(power);
    return `${mantissa}e${exponent < 0 ? "-" : "+"}${String(Math.abs(exponent)).padStart(2, "0")}`;
  }
  const text = Object.is(value, -0) ? "-0" : String(value);
  return /[.e]/.test(text) ? text : `${text}.0`;
}

/** The order of series at a tolerance: Python's `taylor_order`, with its rounding of halves to even numbers. @param {number} tolerance */
function taylorOrder(tolerance) {
  const wanted = 10 + 1.25 * (Math.round(-Math.log10(tolerance) * 1e12) / 1e12 - 6);
  const floor = Math.floor(wanted);
  return wanted - floor === 0.5 ? floor + (floor % 2) : Math.round(wanted);
}

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

/**
 * A row of a pulse: its time since the start, whether it acts, or the time since its end, in each piece.
 * @param {Float64Array} row @param {Float64Array} breaks @param {number} start @param {number} end @param {number} order
 * @param {any} layout
 */
function fillClock(row, breaks, start, end, order, layout) {
  const { width, since, within, after } = layout;
  breaks.forEach((at, i) => {
    const piece = (i + 1) * width;
    const acts = at >= start && at < end ? 1 : 0;
    const past = at >= end ? 1 : 0;
    if (order === since) row[piece] = past ? end - start : acts ? at - start : 0;
    if (order === after) row[piece] = past ? at - end : 0;
    if (order === since) row[piece + 1] = acts;
    else if (order === after) row[piece + 1] = past;
    else if (order === within) row[piece] = acts;
    else if (order === after + 1) row[piece] = past;
  });
}

/**
 * A row of a record: its own polynomials, counted from the load's breakpoints.
 * @param {Float64Array} row @param {Float64Array} breaks @param {any} record @param {number} width
 */
function fillRecord(row, breaks, record, width) {
  for (let i = 0; i <= breaks.length; i++) {
    const anchor = breaks[Math.max(i - 1, 0)];
    const piece = i === 0 ? 0 : placeAbove(record.breaks, anchor);
    const shift = anchor - record.breaks[Math.max(piece - 1, 0)];
    const own = Float64Array.from(record.table[piece]);
    for (let k = 0; k < width - 1; k++) for (let j = width - 2; j >= k; j--) own[j] += shift * own[j + 1];
    row.set(own, i * width);
  }
}

/** The place of the first of sorted numbers that is larger @param {ArrayLike<number>} sorted @param {number} value */
function placeAbove(sorted, value) {
  let low = 0;
  let high = sorted.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (sorted[middle] <= value) low = middle + 1;
    else high = middle;
  }
  return low;
}


/** A system with all of its numbers, ready to run. */
export class PageSystem {
  /** @param {Engine} engine @param {{[path: string]: number}} values */
  constructor(engine, values) {
    const { description } = engine;
    this.engine = engine;
    /** @type {{[path: string]: number}} */
    this.values = {};
    for (const number of description.numbers) this.values[number.path] = values[number.path] ?? number.value;
    const frequency = this.values["load.frequency"];
    /** @type {number | null} */
    this.period = frequency === undefined ? null : (2 * Math.PI) / frequency;
    const extra = description.engine.modes; // behind the parameters: directions of frictions, and which coordinates are free
    this.parameters = Float64Array.from([...description.numbers.map((n) => this.values[n.path]), ...extra]);
    [this.breaks, this.table] = engine.records(this.parameters);
    [this.constants, this.geometry] = engine.derived(this);
  }
}

export class Engine {
  /** @param {WebAssembly.Instance} instance @param {Description} description */
  constructor(instance, description) {
    this.description = description;
    this.layout = description.engine;
    this.exports = /** @type {any} */ (instance.exports);
    this.several = this.layout.several;
    this.names = description.model.coordinates.map((/** @type {any} */ c) => c.name);
    this.rates = description.model.coordinates.map((/** @type {any} */ c) => c.velocity);
    this.dof = this.names.length;
    this.contacts = description.model.contacts.map((/** @type {any} */ c) => c.name);
    this.frictions = description.model.frictions.map((/** @type {any} */ f) => f.name);
    this.top = this.layout.heap;
    this._place();
    this.defaults = this.system({});
  }

  /** Give each array its place in memory. */
  _place() {
    const { layout, dof } = this;
    const kept = 1 + 2 * dof + this.contacts.length;
    this.width = this.several ? kept : 3;
    this.terms = layout.most_order + 2;
    const rows = this.contacts.length + this.frictions.length;
    const breaks = layout.records.most;
    /** @type {{[name: string]: number[]}} */
    this.lengths = {
      numbers: [1],
      state: [2 * dof],
      parameters: [this.description.numbers.length + layout.modes.length],
      constants: [layout.constant_count],
      breaks: [breaks],
      table: [layout.records.rows.length, breaks + 1, layout.records.width],
      geometry: [3],
      signs: [layout.signs.length],
      rows: [rows, layout.ContactColumn.WAITS + 1],
      step_labels: [BUFFER, 2],
      step_spans: [BUFFER, 2],
      step_series: [BUFFER, dof, this.terms],
      event_labels: [BUFFER, 4],
      event_values: [BUFFER, this.width],
    };
    /** @type {{[name: string]: number}} */
    this.addresses = {};
    for (const argument of layout.arguments) {
      if (argument.kind !== "function") this.addresses[argument.name] = this._take(argument, this.lengths[argument.name]);
    }
    const words = layout.arguments.reduce((/** @type {number} */ n, /** @type {Argument} */ a) => n + 1 + a.dimensions, 0);
    this.request = this._bytes(8 * words);
    this.scratch = this._bytes(8 * 4096);
    this.results = this._bytes(8 * 4096);
    this._grow(this.top + (1 << 20));
    this.exports.rewind(this.top);
  }

  /** @param {Argument} argument @param {number[]} lengths */
  _take(argument, lengths) {
    return this._bytes((argument.size ?? 8) * lengths.reduce((a, b) => a * b, 1));
  }

  /** @param {number} count */
  _bytes(count) {
    const at = this.top;
    this.top = Math.ceil((at + count + 8) / 64) * 64;
    return at;
  }

  /** @param {number} size */
  _grow(size) {
    const have = this.exports.memory.buffer.byteLength;
    if (size > have) this.exports.memory.grow(Math.ceil((size - have) / 65536));
  }

  /** @param {number} at @param {number} count */
  _doubles(at, count) {
    return new Float64Array(this.exports.memory.buffer, at, count);
  }

  /** @param {number} at @param {number} count */
  _longs(at, count) {
    return new BigInt64Array(this.exports.memory.buffer, at, count);
  }

  /** @param {string} name @param {ArrayLike<number>} values */
  _put(name, values) {
    this._doubles(this.addresses[name], values.length).set(values);
  }

  /** The numbers of the motion, by the names of Python's record. */
  _record() {
    const view = new DataView(this.exports.memory.buffer, this.addresses.numbers, this.layout.record_size);
    const places = this.layout.record;
    return {
      /** @param {string} name @returns {number} */
      get: (name) => (places[name][1] ? Number(view.getBigInt64(places[name][0], true)) : view.getFloat64(places[name][0], true)),
      /** @param {string} name @param {number} value */
      set: (name, value) => {
        if (places[name][1]) view.setBigInt64(places[name][0], BigInt(value), true);
        else view.setFloat64(places[name][0], value, true);
      },
    };
  }

  /**
   * A system with the given numbers by their dotted paths; the others are those of the page.
   * @param {{[path: string]: number}} values
   */
  system(values) {
    const known = new Set(this.description.numbers.map((/** @type {any} */ n) => n.path));
    for (const path of Object.keys(values)) {
      if (!known.has(path)) throw new Refusal(path, `no parameter '${path}'`);
    }
    return new PageSystem(this, values);
  }

  /**
   * The breakpoints of the load, and the polynomials between them: Python's `record_table`.
   * @param {Float64Array} parameters
   */
  records(parameters) {
    const { rows, pulses, width } = this.layout.records;
    if (!rows.length) return [new Float64Array(0), new Float64Array(0)];
    this._put("parameters", parameters);
    this.exports.edges(this.addresses.parameters, this.results);
    const edges = this._doubles(this.results, 2 * pulses).slice();
    const all = [...edges, ...rows.flatMap((/** @type {any} */ row) => row.breaks ?? [])];
    const breaks = Float64Array.from(new Set(all)).sort();
    const size = (breaks.length + 1) * width;
    const table = new Float64Array(rows.length * size);
    rows.forEach((/** @type {any} */ row, /** @type {number} */ i) => {
      const own = table.subarray(i * size, (i + 1) * size);
      if (row.breaks) fillRecord(own, breaks, row, width);
      else fillClock(own, breaks, edges[2 * row.pulse], edges[2 * row.pulse + 1], row.order, this.layout.records);
    });
    return [breaks, table];
  }

  /** The numbers that Python's traced functions make of the parameters: the constants and the contact's geometry.
   * @param {PageSystem} system @returns {[Float64Array, Float64Array]} */
  derived(system) {
    const { addresses, exports } = this;
    const pieces = system.breaks.length + 1;
    for (const name of ["parameters", "breaks", "table"]) this._put(name, /** @type {any} */ (system)[name]);
    exports.constants(addresses.parameters, addresses.constants);
    const constants = this._doubles(addresses.constants, this.layout.constant_count).slice();
    if (this.several) {
      const count = this.layout.contact_numbers;
      this._env(exports.matrices, pieces, 0n, this.scratch, this.results);
      return [constants, this._doubles(this.results, count).slice()];
    }
    this._env(exports.geometry, pieces, this.addresses.geometry);
    return [constants, this._doubles(addresses.geometry, 3).slice()];
  }

  /**
   * Call a function of the structure whose first argument is the environment.
   * @param {Function} call @param {number} pieces of the load @param {any[]} rest
   */
  _env(call, pieces, ...rest) {
    const { addresses, lengths } = this;
    const table = [addresses.table, BigInt(pieces), BigInt(lengths.table[2])];
    call(addresses.parameters, addresses.constants, addresses.breaks, ...table, ...rest);
  }

  /**
   * The margins at a state with accelerations, by their names.
   * @param {PageSystem} system @param {number} time @param {number} side @param {ArrayLike<number>} state
   */
  margins(system, time, side, state) {
    const { addresses, layout } = this;
    for (const name of ["parameters", "constants", "breaks", "table"]) this._put(name, /** @type {any} */ (system)[name]);
    this._doubles(this.scratch, state.length).set(state);
    const length = system.period ?? 0;
    const [period, local] = length ? divmod(time, length) : [0, time];
    const table = [addresses.table, BigInt(system.breaks.length + 1), BigInt(layout.records.width)];
    const env = [addresses.parameters, addresses.constants, addresses.breaks, ...table];
    const piece = BigInt(placeAbove(system.breaks, time));
    this.exports.margins(local, period * length, side, ...env, piece, this.scratch, this.results);
    const values = this._doubles(this.results, layout.margins.length);
    return Object.fromEntries(layout.margins.map((/** @type {string} */ name, /** @type {number} */ i) => [name, values[i]]));
  }

  /**
   * A motion from a state. A motion that cannot go on is given as far as it goes, with the reason.
   * @param {PageSystem} system
   * @param {{[name: string]: number}} start
   * @param {number} duration
   * @param {{tolerance?: number, periods?: number, side?: number}} options
   */
  simulate(system, start, duration, options = {}) {
    return new Run(this, system, start, duration, options).motion();
  }
}

/** One motion while it is computed. */
class Run {
  /**
   * @param {Engine} engine
   * @param {PageSystem} system
   * @param {{[name: string]: number}} start
   * @param {number} duration
   * @param {{tolerance?: number, periods?: number, side?: number}} options
   */
  constructor(engine, system, start, duration, options) {
    this.engine = engine;
    this.system = system;
    this.tolerance = options.tolerance ?? 1e-12;
    this.position = engine.names.map((/** @type {string} */ name) => start[name] ?? 0);
    this.speeds = engine.rates.map((/** @type {string} */ name) => start[name] ?? 0);
    this.first = start.time ?? 0;
    this.order = taylorOrder(this.tolerance);
    this.length = system.period ?? 0;
    this.options = options;
    this.clock = this._clock(duration, options.periods);
    this._begin();
  }

  /** When the motion starts and ends: forcing periods, and times within them. @param {number} duration @param {number} [periods] */
  _clock(duration, periods) {
    if (this.system.period === null) return { first: 0, local: this.first, last: 0, end: this.first + duration };
    const [first, local] = divmod(this.first, this.length);
    if (periods !== undefined) {
      const whole = Math.floor(periods);
      return { first, local, last: first + whole, end: local + (periods - whole) * this.length };
    }
    const [passed, end] = divmod(local + duration, this.length);
    return { first, local, last: first + passed, end };
  }

  /** Write everything into memory. */
  _begin() {
    const { engine, system, clock } = this;
    const { layout } = engine;
    for (const name of ["parameters", "constants", "breaks", "table"]) engine._put(name, /** @type {any} */ (system)[name]);
    if (engine.several) engine._put("signs", layout.signs);
    else engine._put("geometry", system.geometry);
    new Uint8Array(engine.exports.memory.buffer, engine.addresses.numbers, layout.record_size).fill(0);
    const record = engine._record();
    this.record = record;
    for (const [name, value] of Object.entries(layout.sizes)) record.set(name, /** @type {number} */ (value));
    const numbers = { period: clock.first, last_period: clock.last, time: clock.local, end: clock.end, period_length: this.length };
    for (const [name, value] of Object.entries(numbers)) record.set(name, value);
    record.set("order", this.order);
    record.set("tolerance", this.tolerance);
    record.set("piece", placeAbove(system.breaks, this.first));
    record.set("leave_by", this.options.side ?? 0);
    record.set("dense", 1);
    engine._put("state", [...this.position, ...this.speeds]);
    if (engine.several) this._beginContacts();
    else this._beginSide();
    this._request();
  }

  /** The mode and the side of a state: the rule of Python's `side_of_state`. */
  _beginSide() {
    const { engine, record } = this;
    const { Mode, sizes } = engine.layout;
    const [position] = this.position;
    const [velocity] = this.speeds;
    const [contact, ...rates] = this.system.geometry;
    let into = 0;
    let open = 0;
    let pressed = false;
    for (let i = 0; i < sizes.sides; i++) {
      const side = 1 - 2 * i;
      const gap = rates[i] * (position - contact);
      if (gap > 0 && open === 0) open = side;
      pressed = pressed || gap < 0;
      if (rates[i] * velocity > 0 && into === 0) into = side;
    }
    let [mode, side] = [Mode.ARC, 1];
    if (sizes.sides > 0) {
      if (open !== 0) side = open;
      else if (pressed) {
        const name = engine.names[0];
        throw new Refusal(name, `${name} = ${general(position)} lies beyond the contact at ${name} = ${general(contact)}`);
      } else if (velocity === 0) mode = Mode.CONTACT;
      else if (into !== 0) [mode, side] = [Mode.CONTACT, into];
    }
    record?.set("mode", mode);
    record?.set("side", side);
  }

  /** Which contacts are closed, and which way frictions slide: the rules of Python's `ContactState.at_start`. */
  _beginContacts() {
    const { engine, record } = this;
    const { layout } = engine;
    const { ContactColumn, FrictionColumn, Mode } = layout;
    const { dof } = engine;
    const width = engine.lengths.rows[1];
    const rows = new Array(engine.lengths.rows[0] * width).fill(0);
    const positions = this.system.geometry.subarray(layout.positions_at);
    layout.contact_coordinates.forEach((/** @type {number} */ place, /** @type {number} */ i) => {
      const sign = layout.signs[i];
      const gap = sign * (this.position[place] - positions[i]);
      const rate = sign * this.speeds[place];
      const name = engine.names[place];
      if (gap < 0 || (gap === 0 && rate < 0)) {
        const what = gap < 0 ? "lies beyond the contact" : "moves into the contact";
        const where = `${name} = ${general(this.position[place])}`;
        throw new Refusal(name, `${where} ${what} '${engine.contacts[i]}' at ${name} = ${general(positions[i])}`);
      }
      const row = i * width;
      rows[row + ContactColumn.COORDINATE] = place;
      rows[row + ContactColumn.CLOSED] = gap === 0 && rate === 0 ? 1 : 0;
      rows[row + ContactColumn.SKIP] = gap === 0 ? 1 : 0;
      if (gap === 0) engine._doubles(engine.addresses.state, 2 * dof)[place] = positions[i];
    });
    const grounds = this.system.geometry.subarray(layout.grounds_at);
    layout.friction_coordinates.forEach((/** @type {number} */ place, /** @type {number} */ i) => {
      const row = (i + layout.contact_coordinates.length) * width;
      rows[row + FrictionColumn.COORDINATE] = place;
      rows[row + FrictionColumn.SLIDES] = Math.sign(this.speeds[place] - grounds[i]);
    });
    engine._longs(engine.addresses.rows, rows.length).set(rows.map((x) => BigInt(x)));
    record?.set("mode", Mode.CONTACT);
    record?.set("side", 0);
    record?.set("leave_by", 1); // no release is recorded at the start
  }

  /** The arguments of the kernel, in words of memory. */
  _request() {
    const { engine } = this;
    const { breaks } = this.system;
    const [rows, , width] = engine.lengths.table;
    const own = { breaks: [breaks.length], table: [rows, breaks.length + 1, width] };
    const lengths = { ...engine.lengths, ...own, step_series: [BUFFER, engine.dof, this.order + 2] };
    const words = [];
    for (const argument of engine.layout.arguments) {
      if (argument.kind === "function") words.push(engine.layout.pointers[argument.name]);
      else words.push(engine.addresses[argument.name], .../** @type {any} */ (lengths)[argument.name]);
    }
    engine._longs(engine.request, words.length).set(words.map((x) => BigInt(x)));
  }

  /** Run to the end. */
  motion() {
    const { engine } = this;
    const { Status } = engine.layout;
    const steps = new Steps(engine.dof, this.order + 2, this.length);
    /** @type {MotionEvent[]} */
    const events = [];
    let status = Status.FULL;
    while (status === Status.FULL || status === Status.PAUSED) {
      engine.exports.rewind(engine.top);
      status = engine.exports.advance(engine.request);
      this.record = engine._record();
      this._take(steps, events);
      if (events.length > MOST_EVENTS || steps.count > MOST_STEPS) {
        status = Status.UNRESOLVED;
      }
    }
    steps.settle();
    return new PageMotion(this, steps, events, status);
  }

  /** Empty the buffers. @param {Steps} steps @param {MotionEvent[]} events */
  _take(steps, events) {
    const { engine, record } = this;
    const { addresses } = engine;
    if (!record) return;
    const done = record.get("recorded_steps");
    const terms = this.order + 2;
    const labels = engine._longs(addresses.step_labels, 2 * done);
    const spans = engine._doubles(addresses.step_spans, 2 * done);
    steps.add(done, labels, spans, engine._doubles(addresses.step_series, done * engine.dof * terms));
    const count = record.get("recorded_events");
    const kinds = engine._longs(addresses.event_labels, 4 * count);
    const values = engine._doubles(addresses.event_values, engine.width * count);
    for (let i = 0; i < count; i++) {
      const [period, kind, side, detail] = Array.from(kinds.subarray(4 * i, 4 * i + 4), Number);
      const row = Array.from(values.subarray(engine.width * i, engine.width * (i + 1)));
      events.push(this._event(period * this.length + row[0], kind, side, detail, row));
    }
    record.set("recorded_steps", 0);
    record.set("recorded_events", 0);
  }

  /** @param {number} time @param {number} kind @param {number} side @param {number} detail @param {number[]} row @returns {MotionEvent} */
  _event(time, kind, side, detail, row) {
    const { engine } = this;
    const { dof } = engine;
    const name = engine.layout.event_kinds[kind];
    if (!engine.several) {
      const contact = name === "limit" ? engine.layout.limits[detail] : "";
      return { time, kind: name, contact, side, before: [row[1]], after: [row[2]], impulse: [] };
    }
    const all = [...engine.contacts, ...engine.frictions];
    const chosen = all.filter((_, i) => (side >> i) & 1);
    const both = chosen.length === 2 && engine.contacts.length === 2 && chosen.every((c, i) => c === engine.contacts[i]);
    const [before, after] = [row.slice(1, 1 + dof), row.slice(1 + dof, 1 + 2 * dof)];
    return { time, kind: name, contact: both ? "both" : chosen.join("+"), side, before, after, impulse: row.slice(1 + 2 * dof) };
  }
}

/** The Taylor series of every step. */
class Steps {
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

  /** Coordinates, then velocities, at a time. @param {number} time */
  state(time) {
    const step = Math.max(placeAbove(this.starts, time) - 1, 0);
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

/** A motion from its first instant to its last one. */
export class PageMotion {
  /** @param {Run} run @param {Steps} steps @param {MotionEvent[]} events @param {number} status */
  constructor(run, steps, events, status) {
    const { engine, record } = run;
    const { layout, dof } = engine;
    const { Mode, Status } = layout;
    this.system = run.system;
    this.steps = steps;
    this.events = events;
    const now = (/** @type {string} */ name) => record?.get(name) ?? 0;
    this.time = { first: run.first, last: now("period") * now("period_length") + now("time") };
    this.end = Float64Array.from(engine._doubles(engine.addresses.state, 2 * dof));
    const mode = now("mode");
    this.chatter = mode === Mode.CHATTER ? now("chatter_speed") : null;
    this.side = engine.several ? now("side") : mode === Mode.REST || mode === Mode.CHATTER ? 0 : now("side");
    this.stop = mode === Mode.REST ? "rest" : "horizon";
    if (status !== Status.DONE) this.stop = layout.stops[status] ?? "not_finite";
    this.limit = status === Status.LIMITED && events.length ? events[events.length - 1].contact : "";
    const sentence = layout.refusals[status] ?? "";
    this.reason = sentence
      .replaceAll("{time}", general(this.time.last, 9))
      .replaceAll("{velocity}", general(this.end[dof], 6));
    this.meaning = layout.stop_meanings[this.stop] ?? "";
    this._names = [...engine.names, ...engine.rates];
  }

  /** Coordinates, then velocities; at an impact those after it. @param {number} time */
  state(time) {
    if (time >= this.time.last || !this.steps.count) return this.end.slice();
    return this.steps.state(time);
  }

  /** The side of the contact at a time, 0 at rest; with several contacts Python's number of what is closed. @param {number} time */
  sideAt(time) {
    if (time >= this.time.last || !this.steps.count) return this.side;
    return this.steps.sides[Math.max(placeAbove(this.steps.starts, time) - 1, 0)];
  }

  /** The margins of the model at a time, by their names; null at rest, and where there is nothing to evaluate. @param {number} time */
  margins(time) {
    const { engine } = this.system;
    const { steps } = this;
    if (!engine.layout.margins.length || !steps.count) return null;
    const step = Math.max(placeAbove(steps.starts, Math.min(time, this.time.last)) - 1, 0);
    const side = engine.several ? 1 : steps.sides[step];
    if (side === 0) return null;
    const at = Math.min(time, this.time.last);
    return engine.margins(this.system, at, side, steps.withAccelerations(step, at - steps.starts[step]));
  }

  /** States at many times, by the names of the variables. @param {ArrayLike<number>} times */
  sample(times) {
    /** @type {{[name: string]: Float64Array}} */
    const columns = { time: Float64Array.from(times) };
    for (const name of this._names) columns[name] = new Float64Array(times.length);
    for (let i = 0; i < times.length; i++) {
      const state = this.state(times[i]);
      this._names.forEach((name, k) => (columns[name][i] = state[k]));
    }
    return columns;
  }
}
