/** Every number of the system: a slider, a field to type in, its unit, a range that can be changed, a reset, and what is refused. */

import { withinOthers } from "./checks.js";
import { allDigits, clamp, degreesOf, radians, typedNumber } from "./numbers.js";
import { asElement, isLetter, parameterName, parameterSymbol } from "./symbols.js";

/** @typedef {import("./types.js").NumberEntry} NumberEntry */

const SLIDER_STEPS = 1000; // of a slider: finer than a pixel

/**
 * @typedef {object} FieldHost  What a field needs of the page.
 * @property {(path: string) => number} value
 * @property {(path: string, value: number) => {message: string}|null} change  Sets a number, or says why not.
 * @property {() => boolean} degrees
 * @property {(path: string) => [number, number]|null} range  The range that the reader chose.
 * @property {(path: string, range: [number, number]) => void} setRange
 */

let fields = 0;

/** One number. */
export class NumberField {
  /** @param {HTMLElement} parent @param {NumberEntry} entry @param {FieldHost} host */
  constructor(parent, entry, host) {
    this.entry = entry;
    this.host = host;
    this.id = `number-${++fields}`;
    this.shown = ""; // what is to be seen of the number, as text
    this.typing = false; // a text that is being typed stays as it is
    this.name = entry.path.split(".").slice(1).join(".") || entry.path;
    this.element = document.createElement("div");
    this.element.className = "number";
    this.element.dataset.path = entry.path;
    this.build();
    parent.append(this.element);
    this.show();
  }

  build() {
    const { element } = this;
    const label = document.createElement("label");
    label.htmlFor = `${this.id}-text`;
    const symbol = parameterSymbol(this.entry.path, this.entry.symbol);
    const words = symbol && isLetter(this.entry.path) ? "" : `${parameterName(this.entry.path)} `;
    // The symbol of a state with a longer name would say the name again.
    const again = this.entry.path.startsWith("start.") && [...(symbol?.text ?? "")].length > 1;
    label.append(words, ...(symbol && !again ? [asElement(symbol)] : []));
    this.text = this.input("text", "value");
    this.text.setAttribute("aria-label", parameterName(this.entry.path));
    if (this.entry.text) label.title = this.entry.text;
    this.text.id = `${this.id}-text`;
    this.text.setAttribute("aria-describedby", `${this.id}-refusal`);
    this.unit = document.createElement("span");
    this.unit.className = "unit";
    this.reset = document.createElement("button");
    this.reset.type = "button";
    this.reset.className = "reset";
    this.reset.textContent = "↺";
    this.slider = this.input("range", "slider");
    this.low = this.input("text", "end low");
    this.high = this.input("text", "end high");
    this.refusal = document.createElement("p");
    this.refusal.className = "refusal";
    this.refusal.id = `${this.id}-refusal`;
    this.refusal.setAttribute("role", "alert");
    this.named();
    element.append(label, this.text, this.unit, this.reset, this.low, this.slider, this.high, this.refusal);
    this.listen();
  }

  /** Whether the number is shown in degrees; states are in radians, as the views are. */
  inDegrees() {
    return Boolean(this.entry.angle) && this.host.degrees() && !this.entry.path.startsWith("start.");
  }

  /** Names for screen readers. */
  named() {
    const name = parameterName(this.entry.path);
    this.slider?.setAttribute("aria-label", `${name}, slider`);
    this.low?.setAttribute("aria-label", `${name}, lower end of the slider`);
    this.high?.setAttribute("aria-label", `${name}, upper end of the slider`);
    this.reset?.setAttribute("aria-label", `${name}, back to ${this.written(this.entry.value)}`);
    if (this.reset) this.reset.title = `back to ${this.written(this.entry.value)}`;
  }

  /** @param {string} type @param {string} name */
  input(type, name) {
    const input = document.createElement("input");
    input.type = type;
    input.className = name;
    input.autocomplete = "off";
    input.spellcheck = false;
    if (type === "range") {
      input.min = "0";
      input.max = String(SLIDER_STEPS);
      input.step = "1";
    } else input.inputMode = "text";
    return input;
  }

  listen() {
    const { slider, text, low, high, reset } = this;
    slider?.addEventListener("input", () => {
      const [from, to] = this.range();
      const raw = from + ((to - from) * Number(slider.value)) / SLIDER_STEPS;
      this.change(this.rounded(raw, (to - from) / SLIDER_STEPS));
    });
    text?.addEventListener("input", () => (this.typing = true));
    text?.addEventListener("blur", () => (this.typing = false));
    text?.addEventListener("change", () => {
      this.typing = false;
      this.typed(text.value);
    });
    text?.addEventListener("keydown", (event) => {
      if (event.key !== "Escape") return;
      this.typing = false;
      this.show();
    });
    low?.addEventListener("change", () => this.rangeTyped(low, 0));
    high?.addEventListener("change", () => this.rangeTyped(high, 1));
    reset?.addEventListener("click", () => this.change(this.entry.value));
  }

  /** A slider gives numbers of as few digits as its steps have; whole numbers stay whole. @param {number} raw @param {number} step */
  rounded(raw, step) {
    if (this.entry.whole) return Math.round(raw);
    const degrees = this.inDegrees();
    const [value, size] = degrees ? [degreesOf(raw), degreesOf(step)] : [raw, step];
    const digits = clamp(-Math.floor(Math.log10(size)), 0, 15);
    const short = Number(value.toFixed(digits));
    return degrees ? radians(short) : short;
  }

  /** @returns {[number, number]} */
  range() {
    const chosen = this.host.range(this.entry.path);
    if (chosen) return chosen;
    const value = this.host.value(this.entry.path);
    const [low, high] = withinOthers(this.entry, (path) => this.host.value(path), [this.entry.low, this.entry.high]);
    return [Math.min(low, value), Math.max(high, value)];
  }

  /** @param {string} text */
  typed(text) {
    const found = typedNumber(text, { angle: this.entry.angle, degrees: this.inDegrees(), name: this.name });
    if ("refusal" in found) this.refuse(found.refusal);
    else this.change(found.value);
  }

  /** @param {HTMLInputElement} input @param {0|1} end */
  rangeTyped(input, end) {
    const found = typedNumber(input.value, { angle: this.entry.angle, degrees: this.inDegrees(), name: this.name });
    const range = /** @type {[number, number]} */ ([...this.range()]);
    if ("value" in found) range[end] = found.value;
    if ("refusal" in found) this.refuse(found.refusal);
    else if (!(range[0] < range[1])) this.refuse(`the slider's lower end must lie below its upper end, got ${range.map(allDigits).join(" and ")}`);
    else {
      this.host.setRange(this.entry.path, range);
      this.show();
    }
  }

  /** @param {number} value */
  change(value) {
    const refused = this.host.change(this.entry.path, value);
    if (refused) this.refuse(refused.message);
    else this.show();
  }

  /** @param {string} message */
  refuse(message) {
    if (this.refusal) this.refusal.textContent = `${message}. The page still shows ${this.written(this.host.value(this.entry.path))}${this.entry.angle ? (this.inDegrees() ? "°" : " rad") : ""}.`;
    this.text?.setAttribute("aria-invalid", "true");
    this.element.classList.add("refused");
  }

  /** @param {number} value */
  written(value) {
    return allDigits(this.inDegrees() ? degreesOf(value) : value);
  }

  /** Show the number as it is. */
  show() {
    if (this.typing) return;
    const value = this.host.value(this.entry.path);
    const [low, high] = this.range();
    const shown = [value, low, high, this.inDegrees(), this.text?.value].join();
    if (shown === this.shown && !this.element.classList.contains("refused")) return;
    if (this.text) this.text.value = this.written(value);
    this.text?.classList.toggle("long", this.written(value).length > 11);
    if (this.text) this.text.title = this.written(value).length > 11 ? this.written(value) : "";
    if (this.slider) {
      this.slider.value = String(Math.round((SLIDER_STEPS * (value - low)) / (high - low || 1)));
      this.slider.setAttribute("aria-valuetext", this.written(value));
    }
    const degrees = this.inDegrees();
    if (this.low) this.low.value = this.shortEnd(low);
    if (this.high) this.high.value = this.shortEnd(high);
    if (this.unit) this.unit.textContent = this.entry.angle ? (degrees ? "°" : "rad") : this.entry.unit === "1" ? "" : this.entry.unit;
    if (this.reset) this.reset.hidden = value === this.entry.value;
    if (this.refusal) this.refusal.textContent = "";
    this.text?.removeAttribute("aria-invalid");
    this.element.classList.remove("refused");
    this.shown = [value, low, high, degrees, this.text?.value].join();
  }

  /** The end of a slider, in few digits where they are exact enough to read. @param {number} value */
  shortEnd(value) {
    const shown = this.inDegrees() ? degreesOf(value) : value;
    return allDigits(Number(shown.toPrecision(4)));
  }
}

// A group with more numbers than these folds all but its first and its last ones.
const MOST_IN_SIGHT = 10;
const FIRST_IN_SIGHT = 4;
const LAST_IN_SIGHT = 2;

/** A titled group of numbers. @param {HTMLElement} parent @param {string} title @param {NumberEntry[]} entries @param {FieldHost} host */
export function numberGroup(parent, title, entries, host) {
  if (!entries.length) return [];
  const group = document.createElement("fieldset");
  const legend = document.createElement("legend");
  legend.textContent = title;
  group.append(legend);
  parent.append(group);
  if (entries.length <= MOST_IN_SIGHT) return entries.map((entry) => new NumberField(group, entry, host));
  // of a structure's states only the first ones; the time at the start and the duration come last
  const folded = document.createElement("details");
  folded.className = "folded";
  const summary = document.createElement("summary");
  const hidden = entries.slice(FIRST_IN_SIGHT, -LAST_IN_SIGHT);
  summary.textContent = `${hidden.length} more`;
  folded.append(summary);
  const before = entries.slice(0, FIRST_IN_SIGHT).map((entry) => new NumberField(group, entry, host));
  group.append(folded);
  const within = hidden.map((entry) => new NumberField(folded, entry, host));
  return [...before, ...within, ...entries.slice(-LAST_IN_SIGHT).map((entry) => new NumberField(group, entry, host))];
}
