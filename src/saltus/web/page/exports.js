/** What is seen as a study in TOML, as lines of Python, as PNG, SVG and CSV. */

import { currentPalette } from "./palette.js";
import { SvgContext } from "./svg_context.js";

/** @typedef {import("./types.js").Description} Description */
/** @typedef {import("./types.js").State} State */
/** @typedef {import("./plot.js").Plot} Plot */

/** The system and the motion asked for, with the numbers of the page in their places. @param {Description} description @param {State} state */
export function studyOf(description, state) {
  const system = structuredClone(description.study.system);
  for (const [path, value] of Object.entries(state.values)) put(system, path.split("."), value);
  return { system, simulate: motionOf(description, state) };
}

/** @param {any} place @param {string[]} keys @param {number} value */
function put(place, keys, value) {
  const [first, ...rest] = keys;
  if (first === undefined || place === null || typeof place !== "object") return;
  if (rest.length && typeof place[first] === "object") put(place[first], rest, value);
  else if (!rest.length) place[first] = value;
  else if (typeof place[first] === "number" && rest.length === 1 && (rest[0] === "value" || rest[0] === "mean")) place[first] = value;
}

/** The `[simulate]` table, with one velocity or a list of them. @param {Description} description @param {State} state */
function motionOf(description, state) {
  /** @type {Record<string, any>} */
  const table = {};
  const { coordinates } = description.model;
  for (const { name } of coordinates) table[name] = state.start[name] ?? 0;
  const velocities = coordinates.map(({ velocity }) => state.start[velocity] ?? 0);
  table.velocity = velocities.length === 1 ? velocities[0] : velocities;
  if (state.start.time) table.time = state.start.time;
  const { tol, side, stop_at: stopAt } = description.study.simulate ?? {};
  if (tol !== undefined) table.tol = tol;
  if (side !== undefined && side !== null) table.side = side;
  if (stopAt?.length) table.stop_at = stopAt;
  table[state.values["load.frequency"] === undefined ? "duration" : "periods"] = state.periods;
  return table;
}

/** A study as TOML. @param {Description} description @param {State} state */
export function asToml(description, state) {
  const { system, simulate } = studyOf(description, state);
  const lines = ["# Written by a page of saltus. Run it with: saltus simulate study.toml"];
  for (const [name, table] of Object.entries({ ...system, simulate })) {
    if (table === null || typeof table !== "object") continue;
    lines.push(`[${name}]`);
    for (const [key, value] of Object.entries(table)) if (value !== null) lines.push(`${bareKey(key)} = ${tomlValue(value)}`);
  }
  return `${lines.join("\n")}\n`;
}

/** @param {string} key */
function bareKey(key) {
  return /^[A-Za-z0-9_-]+$/.test(key) ? key : JSON.stringify(key);
}

/** @param {any} value @returns {string} */
function tomlValue(value) {
  if (typeof value === "number") return pythonNumber(value);
  if (typeof value === "boolean") return String(value);
  if (typeof value === "string") return JSON.stringify(value);
  if (Array.isArray(value)) return `[${value.map(tomlValue).join(", ")}]`;
  const parts = Object.entries(value).filter(([, each]) => each !== null);
  return `{ ${parts.map(([key, each]) => `${bareKey(key)} = ${tomlValue(each)}`).join(", ")} }`;
}

/** A number as TOML and Python read it: whole ones keep their point, but for orders and counts. @param {number} value */
function pythonNumber(value) {
  const text = String(value);
  return Number.isInteger(value) && !text.includes("e") ? `${text}.0`.replace(/^-0\.0$/, "-0.0") : text;
}

/** The same as lines of Python. @param {Description} description @param {State} state */
export function asPython(description, state) {
  const { system, simulate } = studyOf(description, state);
  const own = String(system.model.type).split(":");
  const model = own.length > 1 ? own[1] : `saltus.${system.model.type}`;
  const lines = ["import saltus"];
  if (own.length > 1) lines.push(`from ${(own[0] ?? "").replace(/\.py$/, "").split(/[\\/]/).pop()} import ${own[1]}  # the model's own file`);
  lines.push("");
  lines.push("system = saltus.System(");
  lines.push(`    model=${model}(${keywords(system.model)}),`);
  const channels = Object.entries(system.load ?? {}).map(([name, value]) => `${name}=${signal(value)}`);
  lines.push(`    load=saltus.Load(${channels.join(", ")}),`);
  if (system.impact) lines.push(`    impact=saltus.${system.impact.type}(${keywords(system.impact)}),`);
  lines.push(")");
  lines.push(`motion = saltus.simulate(system, ${keywords(simulate)})`);
  lines.push("print(motion)");
  return `${lines.join("\n")}\n`;
}

/** @param {Record<string, any>} table */
function keywords(table) {
  const parts = Object.entries(table).filter(([name, value]) => name !== "type" && value !== null);
  return parts.map(([name, value]) => `${name}=${pythonValue(value)}`).join(", ");
}

/** @param {any} value @returns {string} */
function pythonValue(value) {
  if (typeof value === "number") return pythonNumber(value);
  if (typeof value === "boolean") return value ? "True" : "False";
  if (typeof value === "string") return JSON.stringify(value);
  if (Array.isArray(value)) return `(${value.map(pythonValue).join(", ")}${value.length === 1 ? "," : ""})`;
  return `{${Object.entries(value).map(([key, each]) => `${JSON.stringify(key)}: ${pythonValue(each)}`).join(", ")}}`;
}

/** A load channel: a number, a harmonic, a pulse, a record, or a list of them. @param {any} value @returns {string} */
function signal(value) {
  if (typeof value === "number") return pythonNumber(value);
  if (Array.isArray(value)) return `[${value.map(signal).join(", ")}]`;
  const kind = value.type ?? (value.time ? "Record" : "Harmonic");
  const parts = Object.entries(value).filter(([name, each]) => name !== "type" && each !== null);
  const written = parts.map(([name, each]) => `${name}=${name === "order" ? String(each) : Array.isArray(each) ? `[${each.join(", ")}]` : pythonValue(each)}`);
  return `saltus.${kind}(${written.join(", ")})`;
}

/** A plot as SVG, as it is seen. @param {Plot} plot */
export function asSvg(plot) {
  plot.drawNow();
  const ctx = new SvgContext(plot.width, plot.height);
  const palette = currentPalette();
  plot.paintBase(ctx, palette);
  plot.options.over && plot.painter(ctx, palette).inside(() => plot.options.over?.(plot.painter(ctx, palette)));
  return ctx.text(plot.options.title);
}

/** Columns as CSV, with every digit. @param {Record<string, ArrayLike<number>>} columns */
export function asCsv(columns) {
  const names = Object.keys(columns);
  const size = Math.max(0, ...names.map((name) => columns[name]?.length ?? 0));
  const rows = Array.from({ length: size }, (_, i) => names.map((name) => String(columns[name]?.[i] ?? "")).join(","));
  return `${[names.join(","), ...rows].join("\n")}\n`;
}

/** A picture of both canvases of a plot, at twice its size or more. @param {Plot} plot @returns {Promise<Blob|null>} */
export function asPng(plot) {
  plot.drawNow();
  const [base, top] = [plot.base, plot.top];
  const whole = document.createElement("canvas");
  whole.width = base.width;
  whole.height = base.height;
  const ctx = whole.getContext("2d");
  ctx?.drawImage(base, 0, 0);
  ctx?.drawImage(top, 0, 0);
  return new Promise((resolve) => whole.toBlob(resolve, "image/png"));
}

/** Hand a file to the reader. @param {string} name @param {Blob|string|null} content @param {string} [type] */
export function save(name, content, type = "text/plain") {
  if (content === null) return;
  const blob = typeof content === "string" ? new Blob([content], { type }) : content;
  const anchor = document.createElement("a");
  anchor.href = URL.createObjectURL(blob);
  anchor.download = name;
  anchor.click();
  setTimeout(() => URL.revokeObjectURL(anchor.href), 1000);
}
