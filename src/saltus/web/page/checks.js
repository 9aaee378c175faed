/** Python's own refusals of numbers: the ranges that their fields declare, and its sentences about others. */

/** @typedef {import("./types.js").NumberEntry} NumberEntry */
/** @typedef {{end?: number, of?: string, taken: boolean}} Bound */
/** @typedef {{side: string, of: string, taken: boolean, demand: string}} Beside  A bound by another number, and the words for it. */
/** @typedef {{least?: Bound, most?: Bound, demand?: string, beside?: Beside[], only?: {value: number, said: string}}} Range */

const ASIDE = 60; // A slider keeps this share of its range from an end that is not taken.
const LARGEST = 1e100; // `Limits.value` of Python
const TURN = 360; // degrees: up to it Python asks whether a large angle is in degrees

/** What Python says to these numbers: null, or the first refusal; how two numbers lie to one another is looked at last. @param {NumberEntry[]} entries @param {Record<string, number>} values */
export function refusedNumbers(entries, values) {
  for (const refusal of [refusedNumber, refusedBesideOthers]) {
    for (const entry of entries) {
      const message = refusal(entry, values[entry.path] ?? NaN, values);
      if (message) return { where: entry.path, message };
    }
  }
  return null;
}

/** @param {NumberEntry} entry @param {number} value */
function refusedNumber(entry, value) {
  const { least, most, demand = "must be finite" } = entry.range ?? {};
  const got = `, got ${pythonRepr(value)}`;
  const inside = Number.isFinite(value) && !beyond(least, value, -1) && !beyond(most, value, 1);
  const size = Math.abs(value);
  const hint = entry.angle && size > 3.2 && size <= TURN ? " (degrees?)" : "";
  if (!inside) return `${entry.path} ${demand}${got}${hint}`;
  if (size > LARGEST) return `${entry.path} must be at most 1e+100 in size${got}`;
  return entry.whole && !Number.isInteger(value) ? `${entry.path} must be a whole number${got}` : "";
}

/** @param {NumberEntry} entry @param {number} value @param {Record<string, number>} values */
function refusedBesideOthers(entry, value, values) {
  const { beside = [], only } = entry.range ?? {};
  for (const { side, of, taken, demand } of beside) {
    const end = values[of] ?? NaN;
    if (beyond({ end, taken }, value, side === "least" ? -1 : 1)) return `${entry.path} ${demand}${pythonShort(end)}, got ${pythonShort(value)}`;
  }
  if (!only || value === only.value) return "";
  const text = pythonRepr(value);
  return only.said.replace("{value}", /^-?\d+$/.test(text) ? `${text}.0` : text).replace("{short}", pythonShort(value));
}

/** Whether a value lies beyond a bound that is a number. @param {Bound|undefined} bound @param {number} value @param {number} sign */
function beyond(bound, value, sign) {
  if (bound?.end === undefined) return false;
  const distance = sign * (value - bound.end);
  return distance > 0 || (distance === 0 && !bound.taken);
}

/** A number as Python writes it in six digits. @param {number} value */
function pythonShort(value) {
  const [digits = "", exponent = "0"] = value.toExponential(5).split("e");
  const power = Number(exponent);
  if (power >= -4 && power < 6) return String(Number(value.toPrecision(6)));
  return `${Number(digits)}e${power < 0 ? "-" : "+"}${String(Math.abs(power)).padStart(2, "0")}`;
}

/** A number as Python writes it. @param {number} value */
export function pythonRepr(value) {
  if (Number.isNaN(value)) return "nan";
  if (!Number.isFinite(value)) return value < 0 ? "-inf" : "inf";
  const size = Math.abs(value);
  const text = size >= 1e16 || (size > 0 && size < 1e-4) ? value.toExponential() : String(value);
  return text.replace(/e([+-])(\d)$/, "e$10$2");
}

/** A distance of few digits, so that the end of a slider fits into its box. @param {number} distance */
function short(distance) {
  return Number(distance.toPrecision(1));
}

/** The range of a slider within what Python takes. @param {NumberEntry} entry @returns {NumberEntry} */
export function withinBounds(entry) {
  const { least, most } = entry.range ?? {};
  const least_ = Math.max(entry.low, least?.end ?? -Infinity);
  const most_ = Math.min(entry.high, most?.end ?? Infinity);
  const aside = (most_ - least_) / ASIDE;
  const low = least && !least.taken && least_ === least.end ? least_ + short(aside) : least_;
  const high = most && !most.taken && most_ === most.end ? most_ - short(aside) : most_;
  return low < high ? { ...entry, low, high } : entry;
}

/**
 * The range of a slider where another number of the system bounds this one: it moves with that number.
 * @param {NumberEntry} entry @param {(path: string) => number} valueOf @param {[number, number]} range @returns {[number, number]}
 */
export function withinOthers(entry, valueOf, [low, high]) {
  const { least, most } = entry.range ?? {};
  const aside = (high - low) / ASIDE;
  const from = least?.of === undefined ? low : Math.max(low, valueOf(least.of) + (least.taken ? 0 : aside));
  const to = most?.of === undefined ? high : Math.min(high, valueOf(most.of) - (most.taken ? 0 : aside));
  return from < to ? [from, to] : [low, high];
}
