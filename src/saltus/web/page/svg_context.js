/** A drawing surface with the part of a canvas's methods that the page uses, which writes SVG. */

/** @typedef {[number, number, number, number, number, number]} Matrix */

export class SvgContext {
  /** @param {number} width @param {number} height */
  constructor(width, height) {
    this.width = width;
    this.height = height;
    this.strokeStyle = "#000";
    this.fillStyle = "#000";
    this.lineWidth = 1;
    this.globalAlpha = 1;
    this.font = "10px serif";
    this.textAlign = "left";
    this.textBaseline = "alphabetic";
    this.lineCap = "butt";
    this.lineJoin = "miter";
    /** @type {number[]} */
    this.dash = [];
    /** @type {Matrix} */
    this.matrix = [1, 0, 0, 1, 0, 0];
    this.clipPath = "";
    this.path = "";
    /** @type {string[]} */
    this.parts = [];
    /** @type {any[]} */
    this.saved = [];
    this.clips = 0;
    this.measuring = document.createElement("canvas").getContext("2d");
  }

  save() {
    const { strokeStyle, fillStyle, lineWidth, globalAlpha, font, textAlign, textBaseline, lineCap, lineJoin } = this;
    const { dash, matrix, clipPath } = this;
    const rest = { dash, matrix, clipPath };
    this.saved.push({ strokeStyle, fillStyle, lineWidth, globalAlpha, font, textAlign, textBaseline, lineCap, lineJoin, ...rest });
  }

  restore() {
    Object.assign(this, this.saved.pop());
  }

  /** @param {number} x @param {number} y */
  translate(x, y) {
    const [a, b, c, d, e, f] = this.matrix;
    this.matrix = [a, b, c, d, a * x + c * y + e, b * x + d * y + f];
  }

  /** @param {number} angle */
  rotate(angle) {
    const [a, b, c, d, e, f] = this.matrix;
    const cos = Math.cos(angle);
    const sin = Math.sin(angle);
    this.matrix = [a * cos + c * sin, b * cos + d * sin, c * cos - a * sin, d * cos - b * sin, e, f];
  }

  /** @param {number[]} dash */
  setLineDash(dash) {
    this.dash = dash;
  }

  beginPath() {
    this.path = "";
  }

  /** @param {number} x @param {number} y */
  point(x, y) {
    const [a, b, c, d, e, f] = this.matrix;
    return `${tidy(a * x + c * y + e)} ${tidy(b * x + d * y + f)}`;
  }

  /** @param {number} x @param {number} y */
  moveTo(x, y) {
    this.path += `M${this.point(x, y)}`;
  }

  /** @param {number} x @param {number} y */
  lineTo(x, y) {
    this.path += `${this.path ? "L" : "M"}${this.point(x, y)}`;
  }

  closePath() {
    this.path += "Z";
  }

  /** @param {number} x @param {number} y @param {number} width @param {number} height */
  rect(x, y, width, height) {
    this.moveTo(x, y);
    this.lineTo(x + width, y);
    this.lineTo(x + width, y + height);
    this.lineTo(x, y + height);
    this.closePath();
  }

  /** @param {number} x @param {number} y @param {number} radius @param {number} from @param {number} to */
  arc(x, y, radius, from, to) {
    const whole = Math.abs(to - from) >= 2 * Math.PI - 1e-9;
    const middle = (from + to) / 2;
    const at = (/** @type {number} */ angle) => this.point(x + radius * Math.cos(angle), y + radius * Math.sin(angle));
    const sweep = to > from ? 1 : 0;
    this.path += `${this.path && !whole ? "L" : "M"}${at(from)}`;
    for (const end of [middle, to]) this.path += `A${tidy(radius)} ${tidy(radius)} 0 0 ${sweep} ${at(end)}`;
    if (whole) this.path += "Z";
  }

  stroke() {
    const dash = this.dash.length ? ` stroke-dasharray="${this.dash.map(tidy).join(" ")}"` : "";
    const ends = ` stroke-linecap="${this.lineCap}" stroke-linejoin="${this.lineJoin}"`;
    const pen = `stroke="${this.strokeStyle}" stroke-width="${tidy(this.lineWidth)}"${dash}${ends}`;
    this.add(`<path d="${this.path}" fill="none" ${pen}`);
  }

  fill() {
    this.add(`<path d="${this.path}" fill="${this.fillStyle}"`);
  }

  clip() {
    const name = `clip${++this.clips}`;
    this.parts.push(`<clipPath id="${name}"><path d="${this.path}"/></clipPath>`);
    this.clipPath = ` clip-path="url(#${name})"`;
  }

  /** @param {number} x @param {number} y @param {number} width @param {number} height */
  fillRect(x, y, width, height) {
    this.path = "";
    this.rect(x, y, width, height);
    this.fill();
  }

  /** @param {number} x @param {number} y @param {number} width @param {number} height */
  strokeRect(x, y, width, height) {
    this.path = "";
    this.rect(x, y, width, height);
    this.stroke();
  }

  clearRect() {}

  /** @param {string} text */
  measureText(text) {
    if (!this.measuring) return { width: 0 };
    this.measuring.font = this.font;
    return this.measuring.measureText(text);
  }

  /** @param {string} text @param {number} x @param {number} y */
  fillText(text, x, y) {
    const anchor = { left: "start", start: "start", center: "middle", right: "end", end: "end" }[this.textAlign] ?? "start";
    const base = this.textBaseline === "middle" ? ' dominant-baseline="central"' : "";
    const [a, b, c, d, e, f] = this.matrix.map(tidy);
    const place = `transform="matrix(${a} ${b} ${c} ${d} ${e} ${f})" x="${tidy(x)}" y="${tidy(y)}"`;
    const [, slant, size, family] = /^(italic )?([\d.]+)px (.*)$/.exec(this.font) ?? ["", "", "10", "serif"];
    const style = `font-family="${escapeMarkup(family ?? "")}" font-size="${size}"${slant ? ' font-style="italic"' : ""}`;
    this.add(`<text ${place} ${style} text-anchor="${anchor}"${base} fill="${this.fillStyle}"`, `>${escapeMarkup(text)}</text>`);
  }

  /** @param {string} opening @param {string} end */
  add(opening, end = "/>") {
    const alpha = this.globalAlpha < 1 ? ` opacity="${tidy(this.globalAlpha)}"` : "";
    this.parts.push(`${opening}${alpha}${this.clipPath}${end}`);
  }

  /** The whole picture as text. @param {string} title */
  text(title) {
    const size = `width="${this.width}" height="${this.height}" viewBox="0 0 ${this.width} ${this.height}"`;
    const head = `<svg xmlns="http://www.w3.org/2000/svg" ${size} role="img">`;
    return `${head}\n<title>${escapeMarkup(title)}</title>\n${this.parts.join("\n")}\n</svg>\n`;
  }
}

/** @param {string} text */
export function escapeMarkup(text) {
  return text.replace(/&/g, "&amp;").replace(/</g, "&lt;").replace(/>/g, "&gt;").replace(/"/g, "&quot;");
}

/** @param {number} value */
function tidy(value) {
  return Number(value.toFixed(2));
}
