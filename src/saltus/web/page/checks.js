/** Python's own refusals of numbers: the bounds that it was asked for, and its sentences with the numbers of the page in them. */

/** @typedef {import("./types.js").NumberEntry} NumberEntry */
/** @typedef {{end: number, taken: boolean, of?: string, said: [number, string][]}} Bound */

const ASIDE = 60; // A slider keeps this share of its range from an end that is not taken.

/** What Python says to these numbers: null, or the first refusal; how two numbers lie to one another is looked at last. @param {NumberEntry[]} entries @param {Record<string, number>} values */
export function refusedNumbers(entries, values) {
  /** @type {{where: string, message: string}|null} */
  let between = null;
  for (const entry of entries) {
    const refused = refusedNumber(entry, values);
    if (!refused) continue;
    const said = { where: entry.path, message: refused.message };
    if (!refused.between) return said;
    between ??= said;
  }
  return between;
}

/** @param {NumberEntry} entry @param {Record<string, number>} values @returns {{message: string, between: boolean}|null} */
function refusedNumber(entry, values) {
  const value = values[entry.path] ?? NaN;
  const { least, most, whole } = entry.accepted ?? {};
  const alone = (/** @type {string} */ message) => ({ message, between: false });
  if (!Number.isFinite(value)) return alone(`${entry.path} must be finite, got ${pythonRepr(value)}`);
  const outside = (least && beyond(least, value, -1, values)) || (most && beyond(most, value, 1, values));
  return outside || (whole && !Number.isInteger(value) ? alone(whole.replace("{value}", pythonRepr(value))) : null);
}

/** @param {Bound} bound @param {number} value @param {number} sign @param {Record<string, number>} values */
function beyond(bound, value, sign, values) {
  const end = bound.of === undefined ? bound.end : (values[bound.of] ?? bound.end);
  const distance = sign * (value - end);
  if (distance < 0 || (distance === 0 && bound.taken)) return null;
  const said = bound.said.slice(1).reduce((last, [from, sentence]) => (sign * (value - from) >= 0 ? sentence : last), bound.said[0]?.[1] ?? "");
  const message = said.replace("{value}", pythonRepr(value)).replace("{short}", pythonShort(value)).replace("{other}", pythonShort(end));
  return { message, between: said.includes("{other}") };
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

/** The range of a slider within what Python takes. @param {NumberEntry} entry @returns {NumberEntry} */
export function withinBounds(entry) {
  const { least, most } = entry.accepted ?? {};
  const least_ = least && !least.of ? Math.max(entry.low, least.end) : entry.low;
  const most_ = most && !most.of ? Math.min(entry.high, most.end) : entry.high;
  const aside = (most_ - least_) / ASIDE;
  const low = least && !least.taken && least_ === least.end ? least_ + aside : least_;
  const high = most && !most.taken && most_ === most.end ? most_ - aside : most_;
  return low < high ? { ...entry, low, high } : entry;
}

/**
 * The range of a slider where another number of the system bounds this one: it moves with that number.
 * @param {NumberEntry} entry @param {(path: string) => number} valueOf @param {[number, number]} range @returns {[number, number]}
 */
export function withinOthers(entry, valueOf, [low, high]) {
  const { least, most } = entry.accepted ?? {};
  const aside = (high - low) / ASIDE;
  const from = least?.of === undefined ? low : Math.max(low, valueOf(least.of) + (least.taken ? 0 : aside));
  const to = most?.of === undefined ? high : Math.min(high, valueOf(most.of) - (most.taken ? 0 : aside));
  return from < to ? [from, to] : [low, high];
}
