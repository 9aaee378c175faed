/** Numbers as they are read and written: ticks at round numbers, all digits, and what is typed. */

const MINUS = "\u2212";

/** Round numbers from `low` to `high`, about `count` of them, and at least two: one alone shows no scale. @param {number} low @param {number} high @param {number} count */
export function ticks(low, high, count) {
  let step = roundStep((high - low) / Math.max(count, 1));
  if (!(step > 0) || !Number.isFinite(step)) return { step: 0, values: [] };
  let values = multiples(low, high, step);
  for (let finer = 0; values.length < 2 && finer < 4; finer++) {
    step = roundStep(step / 2.5); // the next lower of 1, 2, 5
    values = multiples(low, high, step);
  }
  return { step, values };
}

/** The multiples of `step` from `low` to `high`, 100 at most. @param {number} low @param {number} high @param {number} step */
function multiples(low, high, step) {
  const first = Math.ceil(low / step - 1e-9);
  const last = Math.floor(high / step + 1e-9);
  /** @type {number[]} */
  const values = [];
  for (let i = first; i <= last && values.length < 100; i++) values.push(i === 0 ? 0 : Number((i * step).toPrecision(12)));
  return values;
}

/** The least of 1, 2, 5 times a power of ten that is not below `size`. @param {number} size */
export function roundStep(size) {
  if (!(size > 0)) return 0;
  const power = 10 ** Math.floor(Math.log10(size));
  for (const factor of [1, 2, 5]) if (factor * power >= size * (1 - 1e-9)) return factor * power;
  return 10 * power;
}

/** A tick's label, with the decimals that its step needs. @param {number} value @param {number} step */
export function tickLabel(value, step) {
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e5 || step < 1e-4) {
    const digits = Math.max(0, Math.floor(Math.log10(size)) - Math.floor(Math.log10(step) + 1e-9));
    return withMinus(value.toExponential(Math.min(digits, 12)).replace("e+", "e"));
  }
  return withMinus(value.toFixed(Math.min(Math.max(0, -Math.floor(Math.log10(step) + 1e-9)), 12)));
}

/** A number with all its digits, as Python writes it but for the exponent's zeros. @param {number} value */
export function allDigits(value) {
  return withMinus(String(value));
}

/** A number rounded to so many significant digits. @param {number} value @param {number} digits */
export function inDigits(value, digits = 4) {
  return Number(value.toPrecision(digits));
}

/** A number for reading, with so many significant digits. @param {number} value @param {number} digits */
export function shortly(value, digits = 6) {
  return withMinus(String(Number(value.toPrecision(digits))));
}

/** @param {string} text */
function withMinus(text) {
  return text.replace(/-/g, MINUS);
}

/**
 * What was typed, as a number; an angle may be written with deg, ° or rad, and counts in `degrees` where no unit is written.
 * @param {string} text @param {{angle?: boolean, degrees?: boolean, name: string}} field
 * @returns {{value: number} | {refusal: string}}
 */
export function typedNumber(text, field) {
  const found = /^\s*([+\-\u2212]?(?:\d+\.?\d*|\.\d+)(?:e[+\-\u2212]?\d+)?)\s*(deg|\u00b0|rad)?\s*$/i.exec(text);
  const unit = found?.[2]?.toLowerCase();
  if (!found || (unit && !field.angle)) {
    const wanted = field.angle ? "a finite number, such as 1.4 rad or 80 deg" : "a finite number";
    return { refusal: `${field.name} must be ${wanted}, got '${text.trim().slice(0, 40)}'` };
  }
  const number = Number((found[1] ?? "").replace(/\u2212/g, "-"));
  if (!Number.isFinite(number)) return { refusal: `${field.name} must be finite, got ${text.trim().slice(0, 40)}` };
  const inDegrees = unit ? unit !== "rad" : Boolean(field.angle && field.degrees);
  return { value: inDegrees ? radians(number) : number };
}

/** Degrees in radians, rounded as NumPy's deg2rad does. @param {number} degrees */
export function radians(degrees) {
  return degrees * (Math.PI / 180);
}

/** Radians in degrees; a number of degrees that rounds to the same radians is preferred. @param {number} value */
export function degreesOf(value) {
  const exact = value * (180 / Math.PI);
  const short = Number(exact.toPrecision(13));
  return Math.abs(radians(short) - value) <= 2e-16 * Math.abs(value) ? short : exact;
}

/** @param {number} value @param {number} low @param {number} high */
export function clamp(value, low, high) {
  return Math.min(Math.max(value, low), high);
}

/** The least and the largest of many finite numbers, or null. @param {Iterable<ArrayLike<number>>} lists */
export function rangeOf(lists) {
  let low = Infinity;
  let high = -Infinity;
  for (const list of lists) {
    for (let i = 0; i < list.length; i++) {
      const value = /** @type {number} */ (list[i]);
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  return low <= high && Number.isFinite(low) && Number.isFinite(high) ? { low, high } : null;
}
