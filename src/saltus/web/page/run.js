/** One motion while it is computed: its start, the kernel that is called until it ends, and the buffers that are emptied between. */

import { divmod, general } from "./python_numbers.js";
import { pieceAt } from "./load_table.js";
import { PageMotion } from "./motion.js";
import { Steps } from "./steps.js";

/** @typedef {import("./engine.js").Engine} Engine */
/** @typedef {import("./engine.js").PageSystem} PageSystem */
/** @typedef {{tolerance?: number, periods?: number, side?: number}} Options */
/** @typedef {{time: number, kind: string, contact: string, side: number, before: number[], after: number[], impulse: number[]}} PageEvent */

export const BUFFER = 1024; // steps, and events, that one call of the kernel may record
const MOST_EVENTS = 200000; // of a motion that is drawn
const LONGEST = 2000; // milliseconds of computing for one motion: a reader waits for it
const MOST_PERIODS = 2 ** 53; // from time 0: beyond, a number is no longer told from the next one

/** What Python would refuse, with its sentence. */
export class Refusal extends Error {
  /** @param {string} where the dotted path, or the name of the argument @param {string} message */
  constructor(where, message) {
    super(message);
    this.name = "Refusal";
    this.where = where;
  }
}

/** The order of series at a tolerance: Python's `taylor_order`, with its rounding of halves to even numbers. @param {number} tolerance */
function taylorOrder(tolerance) {
  const wanted = 10 + 1.25 * (Math.round(-Math.log10(tolerance) * 1e12) / 1e12 - 6);
  const floor = Math.floor(wanted);
  return wanted - floor === 0.5 ? floor + (floor % 2) : Math.round(wanted);
}

export class Run {
  /** @param {Engine} engine @param {PageSystem} system @param {Record<string, number>} start @param {number} duration @param {Options} options */
  constructor(engine, system, start, duration, options) {
    this.engine = engine;
    this.system = system;
    this.tolerance = options.tolerance ?? 1e-12;
    this.position = engine.names.map((name) => start[name] ?? 0);
    this.speeds = engine.rates.map((name) => start[name] ?? 0);
    this.first = start.time ?? 0;
    this.order = taylorOrder(this.tolerance);
    this.length = system.period ?? 0;
    this.check(duration);
    this.begin(this.clock(duration, options.periods), options.side ?? 0);
  }

  /** What Python refuses before it begins. @param {number} duration */
  check(duration) {
    const { names, rates, layout } = this.engine;
    const given = { time: this.first, ...zipped(names, this.position), ...zipped(rates, this.speeds) };
    const bad = Object.entries(given).find(([, value]) => !(Math.abs(value) <= layout.most_size));
    if (bad) throw new Refusal(bad[0], `${bad[0]} must be at most ${general(layout.most_size)} in size, got ${general(bad[1])}`);
    if (!(this.length <= layout.most_size)) throw new Refusal("load.frequency", `the period of the load must be at most ${general(layout.most_size)}, got ${general(this.length)}`);
    const reach = this.length ? (Math.abs(this.first) + Math.abs(duration)) / this.length : 0;
    if (!(reach < MOST_PERIODS)) throw new Refusal("time", `the motion must start and end within 2^53 forcing periods, got ${general(reach)} of them`);
  }

  /** The natural time of the motion: Python's `natural_time`. */
  naturalTime() {
    const { without_period: own, slow_time: slow } = this.engine.layout.natural;
    const ofLoad = this.length > 0 ? this.length / (2 * Math.PI) : Infinity;
    const time = Math.min(ofLoad, own ?? Infinity, this.length > 0 ? (slow ?? Infinity) : Infinity);
    return Number.isFinite(time) ? time : 0;
  }

  /** When the motion starts and ends: forcing periods, and times within them. @param {number} duration @param {number} [periods] */
  clock(duration, periods) {
    if (this.system.period === null) return { first: 0, local: this.first, last: 0, end: this.first + duration };
    const [first, local] = divmod(this.first, this.length);
    if (periods !== undefined) {
      const whole = Math.floor(periods);
      return { first, local, last: first + whole, end: local + (periods - whole) * this.length };
    }
    const [passed, end] = divmod(local + duration, this.length);
    return { first, local, last: first + passed, end };
  }

  /** Write everything into memory. @param {{first: number, local: number, last: number, end: number}} clock @param {number} side */
  begin(clock, side) {
    const { engine, system } = this;
    const { layout } = engine;
    engine.place(system);
    if (engine.several) engine.put("signs", layout.signs);
    else engine.put("geometry", system.geometry);
    new Uint8Array(engine.memory.buffer, engine.address("numbers"), layout.record_size).fill(0);
    const record = engine.record();
    const numbers = {
      ...layout.sizes, period: clock.first, last_period: clock.last, time: clock.local, end: clock.end, period_length: this.length, natural_time: this.naturalTime(),
      order: this.order, tolerance: this.tolerance, piece: pieceAt(system.breaks, layout.sizes.repeats ? this.length : 0, this.first, clock.local), leave_by: side, dense: 1,
    };
    for (const [name, value] of Object.entries(numbers)) record.set(name, value);
    engine.put("state", [...this.position, ...this.speeds]);
    const begun = engine.several ? this.beginContacts() : this.beginSide();
    for (const [name, value] of Object.entries(begun)) record.set(name, value);
    this.requestKernel();
  }

  /** The mode and the side of a state: the rule of Python's `side_of_state`. @returns {Record<string, number>} */
  beginSide() {
    const { Mode, sizes } = this.engine.layout;
    const [position, velocity] = [this.position[0] ?? 0, this.speeds[0] ?? 0];
    const contact = this.system.geometry[0] ?? 0;
    const rates = this.system.geometry.subarray(1);
    let into = 0;
    let open = 0;
    let pressed = false;
    for (let i = 0; i < (sizes.sides ?? 0); i++) {
      const side = 1 - 2 * i;
      const gap = (rates[i] ?? 0) * (position - contact);
      if (gap > 0 && open === 0) open = side;
      pressed = pressed || gap < 0;
      if ((rates[i] ?? 0) * velocity > 0 && into === 0) into = side;
    }
    const { ARC = 0, CONTACT = 0 } = Mode;
    if (!sizes.sides) return { mode: ARC, side: 1 };
    if (open !== 0) return { mode: ARC, side: open };
    if (pressed) {
      const name = this.engine.names[0] ?? "";
      throw new Refusal(name, `${name} = ${general(position)} lies beyond the contact at ${name} = ${general(contact)}`);
    }
    return velocity !== 0 && into === 0 ? { mode: ARC, side: 1 } : { mode: CONTACT, side: velocity === 0 ? 1 : into };
  }

  /** Which contacts are closed, and which way frictions slide: the rules of Python's `ContactState.at_start`. @returns {Record<string, number>} */
  beginContacts() {
    const { engine } = this;
    const { layout, dof } = engine;
    const { COORDINATE = 0, STATE = 0, SKIP = 0, KIND = 0, PRESSED = 0 } = layout.PartColumn;
    const [count = 0, width = 0] = engine.lengths.rows ?? [];
    const rows = new BigInt64Array(count * width);
    const positions = this.system.geometry.subarray(layout.positions_at);
    layout.contact_coordinates.forEach((place, i) => {
      const { gap, rate } = this.gapAt(place, layout.signs[i] ?? 0, positions[i] ?? 0, engine.contacts[i] ?? "");
      rows[i * width + COORDINATE] = BigInt(place);
      rows[i * width + STATE] = gap === 0 && rate === 0 ? 1n : 0n;
      rows[i * width + SKIP] = gap === 0 ? 1n : 0n;
      if (gap === 0) engine.doubles(engine.address("state"), 2 * dof)[place] = positions[i] ?? 0;
    });
    const grounds = this.system.geometry.subarray(layout.grounds_at);
    layout.friction_coordinates.forEach((place, i) => {
      const row = (i + layout.contact_coordinates.length) * width;
      rows[row + COORDINATE] = BigInt(place);
      rows[row + KIND] = BigInt(layout.PartKind.FRICTION ?? 0);
      rows[row + STATE] = BigInt(Math.sign((this.speeds[place] ?? 0) - (grounds[i] ?? 0)));
      if (this.isInert(layout.where_inert[i])) rows[row + PRESSED] = BigInt(layout.inert);
    });
    engine.longs(engine.address("rows"), rows.length).set(rows);
    return { mode: layout.Mode.CONTACT ?? 0, side: 0, leave_by: 1 }; // no release is recorded at the start
  }

  /** Whether a friction has no force: Python's `inert_frictions`. @param {{any: string[], all?: string[]} | undefined} where */
  isInert(where) {
    const isZero = (/** @type {string} */ path) => this.system.values[path] === 0;
    return where !== undefined && (where.any.some(isZero) || (where.all?.every(isZero) ?? false));
  }

  /** The gap of a contact and its rate at the start. @param {number} place @param {number} sign @param {number} position @param {string} contact */
  gapAt(place, sign, position, contact) {
    const at = this.position[place] ?? 0;
    const gap = sign * (at - position);
    const rate = sign * (this.speeds[place] ?? 0);
    const name = this.engine.names[place] ?? "";
    if (gap < 0 || (gap === 0 && rate < 0)) {
      const what = gap < 0 ? "lies beyond the contact" : "moves into the contact";
      throw new Refusal(name, `${name} = ${general(at)} ${what} '${contact}' at ${name} = ${general(position)}`);
    }
    return { gap, rate };
  }

  /** The arguments of the kernel, in words of memory. */
  requestKernel() {
    const { engine } = this;
    const { breaks } = this.system;
    const [rows = 0, , width = 0] = engine.lengths.table ?? [];
    const own = { breaks: [breaks.length], table: [rows, breaks.length + 1, width], step_series: [BUFFER, engine.dof, this.order + 2] };
    /** @type {Record<string, number[]>} */
    const lengths = { ...engine.lengths, ...own };
    const words = engine.layout.arguments.flatMap(({ name, kind }) =>
      kind === "function" ? [engine.pointers[name] ?? 0] : [engine.address(name), ...(lengths[name] ?? [])],
    );
    engine.longs(engine.request, words.length).set(words.map((word) => BigInt(word)));
  }

  /** Run to the end. */
  motion() {
    const { engine } = this;
    const { FULL, PAUSED } = engine.layout.Status;
    const begun = performance.now();
    const steps = new Steps(engine.dof, this.order + 2, this.length);
    /** @type {PageEvent[]} */
    const events = [];
    let status = FULL ?? 0;
    let whole = true;
    while (whole && (status === FULL || status === PAUSED)) {
      engine.functions.rewind(engine.top);
      status = engine.functions.advance(engine.request);
      this.empty(steps, events);
      whole = events.length <= MOST_EVENTS && performance.now() - begun < LONGEST;
    }
    steps.settle();
    return new PageMotion(this, steps, events, status, status === FULL || status === PAUSED);
  }

  /** Empty the buffers. @param {Steps} steps @param {PageEvent[]} events */
  empty(steps, events) {
    const { engine } = this;
    const record = engine.record();
    const done = record.get("recorded_steps");
    const series = engine.doubles(engine.address("step_series"), done * engine.dof * (this.order + 2));
    steps.add(done, engine.longs(engine.address("step_labels"), 2 * done), engine.doubles(engine.address("step_spans"), 2 * done), series);
    const count = record.get("recorded_events");
    const labels = Array.from(engine.longs(engine.address("event_labels"), 4 * count), Number);
    const values = engine.doubles(engine.address("event_values"), engine.width * count);
    for (let i = 0; i < count; i++) {
      events.push(this.event(labels.slice(4 * i, 4 * i + 4), Array.from(values.subarray(engine.width * i, engine.width * (i + 1)))));
    }
    record.set("recorded_steps", 0);
    record.set("recorded_events", 0);
  }

  /** @param {number[]} label @param {number[]} row @returns {PageEvent} */
  event([period = 0, code = 0, side = 0, detail = 0], row) {
    const { engine } = this;
    const { dof, contacts, layout } = engine;
    const time = period * this.length + (row[0] ?? 0);
    const kind = layout.event_kinds[code] ?? "";
    if (!engine.several) {
      const contact = kind === "limit" ? (layout.limits[detail] ?? "") : "";
      return { time, kind, contact, side, before: [row[1] ?? 0], after: [row[2] ?? 0], impulse: [] };
    }
    const chosen = [...contacts, ...engine.frictions].filter((_, i) => Math.floor(side / 2 ** i) % 2 === 1);
    const both = chosen.length === 2 && contacts.length === 2 && chosen.every((name, i) => name === contacts[i]);
    const [before, after] = [row.slice(1, 1 + dof), row.slice(1 + dof, 1 + 2 * dof)];
    return { time, kind, contact: both ? "both" : chosen.join("+"), side, before, after, impulse: row.slice(1 + 2 * dof) };
  }
}

/** @param {string[]} names @param {number[]} values @returns {Record<string, number>} */
function zipped(names, values) {
  return Object.fromEntries(names.map((name, i) => [name, values[i] ?? NaN]));
}
