// The engine of the page: packs a system into the memory of the kernel, runs it, and reads motions out of it.
//
// All equations are in the WebAssembly that Python made of the model: this file knows no model. Where a number lies in memory, and
// what the numbers of events, modes and reasons mean, it reads from tables of `description.engine`, which Python makes from the
// types with which the kernel is compiled. Names are Python's.

import { loadTable, pieceAt } from "./load_table.js";
import { divmod } from "./python_numbers.js";
import { BUFFER, Refusal, Run } from "./run.js";

/**
 * @typedef {{name: string, kind: string, dimensions: number, whole?: boolean, size?: number}} Argument
 * @typedef {Record<string, number>} Enumeration
 *
 * @typedef {object} Layout  Where all numbers are in memory, and what those of the kernel mean: Python's `PortableMotion.layout`.
 * @property {Enumeration} Mode @property {Enumeration} Status @property {Enumeration} EventCode
 * @property {Enumeration} PartKind @property {Enumeration} PartColumn
 * @property {Record<string, [number, boolean]>} record  The place of each number of the motion, and whether it is whole.
 * @property {number} record_size @property {number} most_size @property {number} most_order @property {Argument[]} arguments @property {boolean} several
 * @property {Record<string, number>} sizes @property {number} constant_count @property {number[]} data @property {number[]} modes @property {number[]} signs
 * @property {number[]} contact_coordinates @property {number[]} friction_coordinates
 * @property {{any: string[], all?: string[]}[]} where_inert @property {number} inert  By which numbers frictions have no force, and the mark of these.
 * @property {number} positions_at @property {number} grounds_at @property {number} contact_numbers
 * @property {{without_period: number|null, slow_time: number|null}} natural
 * @property {string[]} limits @property {import("./load_table.js").Records} records
 * @property {string[]} margins  What can be evaluated along a motion; the kinetic energy is the last with `energy`.
 * @property {{kind: string, role: string, points: number}[]} drawing  The shapes of the model's own drawing.
 * @property {boolean} energy @property {string[]} event_kinds
 * @property {Record<number, string>} refusals @property {Record<number, string>} stops @property {Record<string, string>} stop_meanings
 * @property {string[][]} functions  Of the kernel and of the structure, in the order of their words in memory.
 * @property {number[]} code_sizes  Bytes of both modules. @property {number} kernel_data  Bytes that the data of the kernel may take.
 *
 * @typedef {object} EngineDescription  What the engine needs of the page's description.
 * @property {Layout} engine
 * @property {{path: string, value: number}[]} numbers
 * @property {{coordinates: {name: string, velocity: string}[], contacts: {name: string}[], frictions: {name: string}[]}} model
 *
 * @typedef {object} Functions  What Python has compiled.
 * @property {(request: number) => number} advance @property {(top: number) => void} rewind
 * @property {(parameters: number, out: number) => void} constants @property {(parameters: number, out: number) => void} edges
 * @property {(...all: any[]) => void} geometry @property {(...all: any[]) => void} matrices @property {(...all: any[]) => void} margins
 * @property {(...all: any[]) => void} [drawing]
 */

// Bytes of the stack, and of a unit of memory; how many functions the table can hold.
const STACK = 1 << 18;
const PAGE = 1 << 16;
const MOST_FUNCTIONS = 1024;

/**
 * The modules of the kernel and of the structure, in one memory. @param {Uint8Array | ArrayBuffer} wasm @param {EngineDescription} description
 */
export async function open(wasm, description) {
  const { functions, code_sizes: sizes, kernel_data: room } = description.engine;
  const [kernelSize = 0] = sizes;
  const memory = new WebAssembly.Memory({ initial: Math.ceil((wasm.byteLength + room + STACK) / PAGE) + 16 });
  const stack = new WebAssembly.Global({ value: "i32", mutable: true }, 0);
  /** @type {Record<string, any>} */
  const made = {};
  /**
   * Run a module, whose data begin with the words that `module` of Python's `web/objects.py` writes; gives the end of its data.
   * @param {Uint8Array | ArrayBuffer} code @param {string[]} names
   */
  const run = async (code, names) => {
    const table = new WebAssembly.Table({ element: "anyfunc", initial: MOST_FUNCTIONS });
    // The names with lines below are LLVM's.
    const env = { ...made, __linear_memory: memory, __indirect_function_table: table, __stack_pointer: stack };
    await WebAssembly.instantiate(/** @type {any} */ (code), { env });
    const words = new Uint32Array(memory.buffer, 0, names.length + 1);
    names.forEach((name, i) => (made[name] = table.get(words[i] ?? 0)));
    return { table, end: (words[names.length] ?? 0) + 8 };
  };
  const kernel = await run(wasm.slice(0, kernelSize), functions[0] ?? []);
  if (kernel.end > room) throw new Error(`the kernel has ${kernel.end} bytes of data`);
  const data = new Uint8Array(memory.buffer, 0, kernel.end).slice();
  const structure = await run(wasm.slice(kernelSize), functions[1] ?? []);
  new Uint8Array(memory.buffer).set(data); // where the structure has unused bytes
  const heap = Math.ceil(structure.end / 16) * 16 + STACK;
  stack.value = heap; // it grows downwards
  // The kernel calls the functions of the structure through its table.
  const first = MOST_FUNCTIONS - (functions[1] ?? []).length;
  const pointers = Object.fromEntries((functions[1] ?? []).map((name, i) => [name, first + i]));
  for (const [name, place] of Object.entries(pointers)) kernel.table.set(place, made[name]);
  return new Engine(memory, pointers, heap, /** @type {any} */ (made), description);
}

/** A system with all of its numbers, ready to run. */
export class PageSystem {
  /** @param {Engine} engine @param {Record<string, number>} values */
  constructor(engine, values) {
    const { numbers, engine: layout } = engine.description;
    this.engine = engine;
    /** @type {Record<string, number>} */
    this.values = Object.fromEntries(numbers.map(({ path, value }) => [path, values[path] ?? value]));
    const frequency = this.values["load.frequency"];
    /** @type {number | null} */
    this.period = frequency === undefined ? null : (2 * Math.PI) / frequency;
    // Behind the parameters: directions of frictions, and which coordinates are free.
    this.parameters = Float64Array.from([...numbers.map(({ path }) => this.values[path] ?? NaN), ...layout.modes]);
    /** What the functions of the structure are given, once it has been asked for. @type {any[]|null} */
    this.environment = null;
    const [breaks, table] = engine.loadTables(this.parameters);
    this.breaks = breaks;
    this.table = table;
    const [constants, geometry] = engine.derived(this);
    this.constants = constants;
    this.geometry = geometry;
  }
}

export class Engine {
  /**
   * @param {WebAssembly.Memory} memory @param {Record<string, number>} pointers  Places in the table, by the function's name.
   * @param {number} heap  The first byte that is free. @param {Functions} functions @param {EngineDescription} description
   */
  constructor(memory, pointers, heap, functions, description) {
    this.description = description;
    this.layout = description.engine;
    this.memory = memory;
    this.pointers = pointers;
    this.functions = functions;
    this.several = this.layout.several;
    this.names = description.model.coordinates.map(({ name }) => name);
    this.rates = description.model.coordinates.map(({ velocity }) => velocity);
    this.dof = this.names.length;
    this.contacts = description.model.contacts.map(({ name }) => name);
    this.frictions = description.model.frictions.map(({ name }) => name);
    this.known = new Set(description.numbers.map(({ path }) => path));
    this.top = heap;
    this.width = this.several ? 1 + 2 * this.dof + this.contacts.length : 3; // of an event
    this.lengths = lengthsOf(this);
    /** @type {Record<string, number>} */
    this.addresses = {};
    for (const { name, kind, size } of this.layout.arguments) {
      const count = (this.lengths[name] ?? []).reduce((a, b) => a * b, 1);
      if (kind !== "function") this.addresses[name] = this.bytes((size ?? 8) * count);
    }
    this.request = this.bytes(8 * this.layout.arguments.reduce((n, { dimensions }) => n + 1 + dimensions, 0));
    this.scratch = this.bytes(8 * 4096);
    this.results = this.bytes(8 * 4096);
    this.grow(this.top + (1 << 20));
    this.functions.rewind(this.top);
    /** The system whose numbers are in memory. @type {PageSystem|null} */
    this.placed = null;
  }

  /** Room for so many bytes. @param {number} count */
  bytes(count) {
    const at = this.top;
    this.top = Math.ceil((at + count + 8) / 64) * 64;
    return at;
  }

  /** @param {number} size */
  grow(size) {
    const { memory } = this;
    const have = memory.buffer.byteLength;
    if (size > have) memory.grow(Math.ceil((size - have) / 65536));
  }

  /** @param {number} at @param {number} count */
  doubles(at, count) {
    return new Float64Array(this.memory.buffer, at, count);
  }

  /** @param {number} at @param {number} count */
  longs(at, count) {
    return new BigInt64Array(this.memory.buffer, at, count);
  }

  /** Where an argument of the kernel is. @param {string} name */
  address(name) {
    const found = this.addresses[name];
    if (found === undefined) throw new Error(`the kernel has no argument ${name}`);
    return found;
  }

  /** @param {string} name @param {ArrayLike<number>} values */
  put(name, values) {
    this.doubles(this.address(name), values.length).set(values);
  }

  /** Put the numbers of a system into memory, if they are not there. @param {PageSystem} system */
  place(system) {
    if (this.placed === system) return;
    this.put("parameters", system.parameters);
    this.put("constants", system.constants);
    this.put("breaks", system.breaks);
    this.put("table", system.table);
    this.placed = system;
  }

  /** The numbers of the motion, by the names of Python's record. */
  record() {
    const view = new DataView(this.memory.buffer, this.address("numbers"), this.layout.record_size);
    const place = (/** @type {string} */ name) => /** @type {[number, boolean]} */ (this.layout.record[name]);
    return {
      /** @param {string} name @returns {number} */
      get: (name) => (place(name)[1] ? Number(view.getBigInt64(place(name)[0], true)) : view.getFloat64(place(name)[0], true)),
      /** @param {string} name @param {number} value */
      set: (name, value) => {
        if (place(name)[1]) view.setBigInt64(place(name)[0], BigInt(value), true);
        else view.setFloat64(place(name)[0], value, true);
      },
    };
  }

  /** A system with the given numbers by their dotted paths; the others are those of the page. @param {Record<string, number>} values */
  system(values) {
    const unknown = Object.keys(values).find((path) => !this.known.has(path));
    if (unknown !== undefined) throw new Refusal(unknown, `no parameter '${unknown}'`);
    return new PageSystem(this, values);
  }

  /** The breakpoints of the load, and the polynomials between them. @param {Float64Array} parameters @returns {[Float64Array, Float64Array]} */
  loadTables(parameters) {
    const { records } = this.layout;
    if (!records.rows.length) return [new Float64Array(0), new Float64Array(0)];
    this.placed = null;
    this.put("parameters", parameters);
    this.functions.edges(this.address("parameters"), this.results);
    return loadTable(records, this.doubles(this.results, 3 * records.pulses).slice());
  }

  /** The numbers that Python's traced functions make of the parameters: the constants, and the geometry of the contacts. @param {PageSystem} system @returns {[Float64Array, Float64Array]} */
  derived(system) {
    const { functions, layout } = this;
    this.placed = null;
    this.put("parameters", system.parameters);
    this.put("breaks", system.breaks);
    this.put("table", system.table);
    functions.constants(this.address("parameters"), this.address("constants"));
    this.doubles(this.address("constants"), layout.constant_count).set(layout.data, layout.constant_count - layout.data.length);
    const constants = this.doubles(this.address("constants"), layout.constant_count).slice();
    if (this.several) {
      functions.matrices(...this.environment(system), 0n, this.scratch, this.results);
      return [constants, this.doubles(this.results, layout.contact_numbers).slice()];
    }
    functions.geometry(...this.environment(system), this.address("geometry"));
    return [constants, this.doubles(this.address("geometry"), 3).slice()];
  }

  /** What the functions of a structure are given of a system. @param {PageSystem} system */
  environment(system) {
    const pieces = BigInt(system.breaks.length + 1);
    system.environment ??= [this.address("parameters"), this.address("constants"), this.address("breaks"), this.address("table"), pieces, BigInt(this.layout.records.width)];
    return system.environment;
  }

  /**
   * The margins of the model, and its kinetic energy behind them, at a state with accelerations; the next call overwrites them.
   * @param {PageSystem} system @param {number} time @param {number} side @param {ArrayLike<number>} state
   */
  evaluated(system, time, side, state) {
    return this.called(this.functions.margins, system, time, side, state, this.layout.margins.length);
  }

  /** The model's own drawing in a state, or null where it has none. @param {PageSystem} system @param {ArrayLike<number>} state @param {number} time */
  drawing(system, state, time) {
    const { drawing } = this.functions;
    if (!drawing) return null;
    const count = this.layout.drawing.reduce((sum, { points }) => sum + 2 * points + 1, 0);
    const values = Array.from(this.called(drawing, system, time, 1, state, count));
    let at = 0;
    return this.layout.drawing.map(({ kind, role, points }) => {
      const places = Array.from({ length: points }, (_, i) => values.slice(at + 2 * i, at + 2 * i + 2));
      at += 2 * points + 1;
      return { kind, role, points: places, radius: values[at - 1] ?? 0 };
    });
  }

  /** @param {Function} call @param {PageSystem} system @param {number} time @param {number} side @param {ArrayLike<number>} state @param {number} count */
  called(call, system, time, side, state, count) {
    this.place(system);
    this.doubles(this.scratch, state.length).set(state);
    const length = system.period ?? 0;
    const [period, local] = length ? divmod(time, length) : [0, time];
    const piece = BigInt(pieceAt(system.breaks, this.layout.sizes.repeats ? length : 0, time, local));
    call(local, period * length, side, ...this.environment(system), piece, this.scratch, this.results);
    return this.doubles(this.results, count);
  }

  /**
   * A motion from a state. A motion that cannot go on is given as far as it goes, with the reason.
   * @param {PageSystem} system @param {Record<string, number>} start @param {number} duration
   * @param {import("./run.js").Options} options
   */
  simulate(system, start, duration, options = {}) {
    return new Run(this, system, start, duration, options).motion();
  }
}

/** How many numbers each argument of the kernel has, along each of its dimensions. @param {Engine} engine */
function lengthsOf({ layout, dof, contacts, frictions, description, width }) {
  const { most, rows, width: terms } = layout.records;
  /** @type {Record<string, number[]>} */
  const lengths = {
    numbers: [1], state: [2 * dof],
    parameters: [description.numbers.length + layout.modes.length], constants: [layout.constant_count],
    breaks: [most], table: [rows.length, most + 1, terms],
    geometry: [3], signs: [layout.signs.length], eigenmodes: [0],
    rows: [contacts.length + frictions.length, Object.keys(layout.PartColumn).length],
    step_labels: [BUFFER, 2], step_spans: [BUFFER, 2], step_series: [BUFFER, dof, layout.most_order + 2],
    event_labels: [BUFFER, 4], event_values: [BUFFER, width],
  };
  return lengths;
}
