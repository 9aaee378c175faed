/** A picture with two axes: ticks, names and units, zoom and pan, a cursor that reads out. All views are made of it. */

import { clamp, shortly, tickLabel, ticks } from "./numbers.js";
import { asText, typeset } from "./symbols.js";
import { currentPalette } from "./palette.js";
import { followGestures } from "./gestures.js";

/** @typedef {import("./palette.js").Palette} Palette */
/** @typedef {import("./palette.js").Line} Line */
/** @typedef {import("./symbols.js").Symbol_} Symbol_ */
/** @typedef {{name: (string|Symbol_)[], low?: number, high?: number}} Axis */
/** @typedef {[number, number, number, number]} Window  Least and largest abscissa, least and largest ordinate. */

const THIN = 1.4; // pixels
const UNSEEN = 0.4; // pixels: points of a curve that are nearer than this to the one before are left out
const PIECE = 40; // points of a curve that are drawn at once: browsers draw short paths faster
const FULL = 1e-300; // No window is narrower than rounding allows: see `narrowest`.

/**
 * @typedef {object} PlotOptions
 * @property {string} id @property {string} title
 * @property {() => {x: Axis, y: Axis}} axes
 * @property {() => Window|null} bounds  What there is to see.
 * @property {(painter: Painter) => void} paint  What does not move.
 * @property {(painter: Painter) => void} [over]  What moves: marks and the cursor.
 * @property {(x: number, y: number, plot: Plot) => void} [act]  A click, or Enter at the cursor.
 * @property {(x: number, y: number, plot: Plot) => string|null} [read]  What is under the cursor, in words.
 * @property {() => void} [leave]  The pointer has gone.
 * @property {(key: string) => boolean} [key]  A key of the view's own; true if it was used.
 * @property {(window: Window|null) => void} zoomed  The window was changed by the reader.
 * @property {() => Window|null} window  The window that the reader chose, or null.
 * @property {string} [instructions]
 * @property {() => string} [empty]  What is said where there is nothing to see.
 */

export class Plot {
  /** @param {HTMLElement} host @param {PlotOptions} options */
  constructor(host, options) {
    this.host = host;
    this.options = options;
    this.base = document.createElement("canvas");
    this.top = document.createElement("canvas");
    this.base.setAttribute("aria-hidden", "true");
    this.top.className = "top";
    this.top.tabIndex = 0;
    this.top.setAttribute("role", "application");
    this.top.setAttribute("aria-roledescription", "plot");
    this.top.setAttribute("aria-label", options.title);
    host.append(this.base, this.top);
    this.readout = document.createElement("output");
    this.readout.className = "readout";
    this.readout.setAttribute("aria-live", "polite");
    host.after(this.readout);
    /** @type {{x: number, y: number}|null} */
    this.cursor = null;
    this.width = 0;
    this.ratio = 1;
    this.height = 0;
    this.stale = true;
    this.onScreen = true;
    this.measured = false;
    watched(host, this);
    /** What there is to see, as it was when the picture was drawn. @type {Window|null} */
    this.all = null;
    followGestures(this);
  }

  /** Fit the canvases to their place; true where they changed. */
  resize() {
    if (this.measured) return false;
    this.measured = true;
    const box = this.host.getBoundingClientRect();
    const ratio = globalThis.devicePixelRatio || 1;
    const [width, height] = [Math.round(box.width), Math.round(box.height)];
    const same = width === this.width && height === this.height && ratio === this.ratio;
    if (same || !width || !height) return false;
    [this.width, this.height, this.ratio] = [width, height, ratio];
    for (const canvas of [this.base, this.top]) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    this.stale = true;
    return true;
  }

  /** The window that is seen: the reader's, or all with a margin. @returns {Window} */
  seen() {
    const chosen = this.options.window();
    if (chosen) return chosen;
    const all = this.all ?? [0, 1, 0, 1];
    const { x, y } = this.options.axes();
    const [x0, x1] = widened(all[0], all[1], x);
    const [y0, y1] = widened(all[2], all[3], y);
    return [x0, x1, y0, y1];
  }

  /** Draw all, or with `onlyOver` only what moves; a plot that is off the screen waits until it is seen. @param {boolean} onlyOver */
  draw(onlyOver = false) {
    if (!onlyOver) this.stale = true;
    if (this.onScreen) this.drawNow(onlyOver);
  }

  /** @param {boolean} onlyOver */
  drawNow(onlyOver = false) {
    this.resize();
    if (!this.width) return;
    const palette = currentPalette();
    if (!onlyOver || this.stale) {
      this.all = this.options.bounds();
      const ctx = /** @type {CanvasRenderingContext2D} */ (this.base.getContext("2d"));
      ctx.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
      this.paintBase(ctx, palette);
      this.stale = false;
    }
    const over = /** @type {CanvasRenderingContext2D} */ (this.top.getContext("2d"));
    over.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    over.clearRect(0, 0, this.width, this.height);
    const painter = this.painter(over, palette);
    if (!this.all && this.options.empty) return;
    painter.inside(() => {
      this.options.over?.(painter);
      if (this.cursor) painter.cross(this.cursor.x, this.cursor.y);
    });
  }

  /** @param {any} ctx @param {Palette} palette */
  paintBase(ctx, palette) {
    ctx.fillStyle = palette.paper;
    ctx.fillRect(0, 0, this.width, this.height);
    const painter = this.painter(ctx, palette);
    const empty = !this.all && this.options.empty?.();
    if (empty) return painter.say(empty);
    painter.axes();
    painter.inside(() => this.options.paint(painter));
    painter.frame();
  }

  /** @param {any} ctx @param {Palette} palette */
  painter(ctx, palette) {
    return new Painter(ctx, palette, this.seen(), this.width, this.height, this.options.axes());
  }

  /** The point of the plane at a place of the picture. @param {number} left @param {number} top */
  at(left, top) {
    const [x0, x1, y0, y1] = this.seen();
    const frame = frameOf(this.width, this.height);
    const x = x0 + ((left - frame.left) / frame.width) * (x1 - x0);
    return { x, y: y1 - ((top - frame.top) / frame.height) * (y1 - y0) };
  }

  /** Zoom by `factor` (below 1: closer) about a point. @param {number} factor @param {number} x @param {number} y */
  zoom(factor, x, y) {
    const [x0, x1, y0, y1] = this.seen();
    const window_ = [x + (x0 - x) * factor, x + (x1 - x) * factor, y + (y0 - y) * factor, y + (y1 - y) * factor];
    if (wideEnough(window_)) this.options.zoomed(/** @type {Window} */ (window_));
  }

  /** Move the window by shares of its size. @param {number} right @param {number} up */
  pan(right, up) {
    const [x0, x1, y0, y1] = this.seen();
    const [dx, dy] = [right * (x1 - x0), up * (y1 - y0)];
    const window_ = [x0 + dx, x1 + dx, y0 + dy, y1 + dy];
    if (wideEnough(window_)) this.options.zoomed(/** @type {Window} */ (window_));
  }

  whole() {
    this.options.zoomed(null);
  }

  /** Put the cursor somewhere and read out what is there; null takes it away. @param {{x: number, y: number}|null} point */
  point(point) {
    this.cursor = point;
    const said = point && this.options.read?.(point.x, point.y, this);
    this.readout.textContent = said || "";
    if (!point) this.options.leave?.();
  }
}

/** Let a plot know when its place changes its size, and when it comes onto the screen. @param {HTMLElement} host @param {Plot} plot */
function watched(host, plot) {
  new ResizeObserver(() => {
    plot.measured = false;
    plot.draw(true);
  }).observe(host);
  new IntersectionObserver((seen) => {
    plot.onScreen = Boolean(seen.at(-1)?.isIntersecting);
    if (plot.onScreen) plot.draw(true);
  }).observe(host);
}

/** The rectangle inside the axes. @param {number} width @param {number} height */
export function frameOf(width, height) {
  const [left, right, top, bottom] = [58, 12, 10, 42];
  return { left, top, width: Math.max(width - left - right, 10), height: Math.max(height - top - bottom, 10) };
}

/** What is seen of a range; numbers that differ by rounding alone are one number. @param {number} low @param {number} high @param {Axis} axis @returns {[number, number]} */
function widened(low, high, axis) {
  const rounding = 1e-12 * Math.max(Math.abs(low), Math.abs(high));
  const room = high - low > rounding ? 0.05 * (high - low) : Math.max(Math.abs(low) * 0.1, 0.5);
  return [axis.low ?? low - room, axis.high ?? high + room];
}

/** Whether a window is wide enough for its numbers to differ, and not too wide. @param {number[]} window_ */
export function wideEnough(window_) {
  if (window_.length !== 4 || !window_.every((value) => Number.isFinite(value) && Math.abs(value) < 1e100)) return false;
  const [x0, x1, y0, y1] = /** @type {Window} */ (window_);
  const narrowest = (/** @type {number} */ a, /** @type {number} */ b) => FULL + 1e-13 * Math.max(Math.abs(a), Math.abs(b));
  return x1 - x0 > narrowest(x0, x1) && y1 - y0 > narrowest(y0, y1);
}

/** The shapes of the kinds of special points, as in the figures of Python: how many corners, the direction of the first in quarter turns, and how far the corners between lie from the middle. @type {Record<string, [number, number, number]>} */
const SHAPES = {
  LP: [24, 0, 1], PD: [4, 0.5, 1], BPC: [4, 0, 1], NS: [5, -1, 0.45], GR: [3, -1, 1], SW: [3, 1, 1], GS: [3, 2, 1], SS: [3, 0, 1], CS: [4, 0.5, 0.4], AS: [4, 0, 0.4], RL: [6, 0, 1], CH: [6, 1, 0.5],
};

/** The shapes of what a model has names of its own for, as its margins, one after the other. @type {[number, number, number][]} */
const OWN_SHAPES = [[4, 0.5, 0.75], [2, 1, 0.35], [2, 0, 0.35], [5, 1, 0.45], [3, -1, 0.35], [3, 1, 0.35], [8, 0, 0.5], [5, -1, 1]];

/** Whether a kind of special points is one of the field's, which have abbreviations. @param {string} kind */
export function isAbbreviated(kind) {
  return kind in SHAPES;
}

/** The corners of a kind's shape about (0, 0), of the radius 1. @param {string} kind @param {number} [place] among the kinds that have no shape of their own @returns {[number, number][]} */
export function cornersOf(kind, place = 0) {
  const [count, turn, between] = /** @type {[number, number, number]} */ (SHAPES[kind] ?? OWN_SHAPES[place % OWN_SHAPES.length]);
  const at = (/** @type {number} */ share, /** @type {number} */ r) => /** @type {[number, number]} */ ([r * Math.cos(Math.PI * (turn / 2 + 2 * share)), r * Math.sin(Math.PI * (turn / 2 + 2 * share))]);
  return Array.from({ length: count }, (_, i) => (between < 1 ? [at(i / count, 1), at((i + 0.5) / count, between)] : [at(i / count, 1)])).flat();
}

/** Draws in the coordinates of a window, on a canvas or as SVG. */
export class Painter {
  /**
   * @param {any} ctx @param {Palette} palette @param {Window} window_ @param {number} width @param {number} height
   * @param {{x: Axis, y: Axis}} axes
   */
  constructor(ctx, palette, window_, width, height, axes) {
    this.ctx = ctx;
    this.palette = palette;
    this.window = window_;
    this.box = frameOf(width, height);
    this.width = width;
    this.height = height;
    this.names = axes;
    /** Whether what is drawn is of other numbers than the page has. */
    this.fade = false;
  }

  /** @param {number} value */
  x(value) {
    const [x0, x1] = this.window;
    return this.box.left + ((value - x0) / (x1 - x0)) * this.box.width;
  }

  /** @param {number} value */
  y(value) {
    const [, , y0, y1] = this.window;
    return this.box.top + ((y1 - value) / (y1 - y0)) * this.box.height;
  }

  /** Draw with what lies outside of the axes cut off. @param {() => void} draw */
  inside(draw) {
    const { left, top, width, height } = this.box;
    this.ctx.save();
    this.ctx.beginPath();
    this.ctx.rect(left, top, width, height);
    this.ctx.clip();
    draw();
    this.ctx.restore();
  }

  axes() {
    const { ctx, palette, box } = this;
    const [x0, x1, y0, y1] = this.window;
    const along = ticks(x0, x1, clamp(Math.round(box.width / 75), 3, 10));
    const up = ticks(y0, y1, clamp(Math.round(box.height / 42), 2, 9));
    ctx.fillStyle = palette.ink;
    ctx.strokeStyle = palette.faint;
    ctx.lineWidth = 0.5;
    this.inside(() => {
      if (x0 < 0 && x1 > 0) this.vertical(0, { color: palette.faint, width: 0.7 });
      if (y0 < 0 && y1 > 0) this.horizontal(0, { color: palette.faint, width: 0.7 });
    });
    ctx.font = `12px ${palette.serif}`;
    ctx.textBaseline = "alphabetic";
    ctx.textAlign = "center";
    for (const value of along.values) ctx.fillText(tickLabel(value, along.step), this.x(value), box.top + box.height + 15);
    ctx.textAlign = "right";
    for (const value of up.values) ctx.fillText(tickLabel(value, up.step), box.left - 7, this.y(value) + 4);
    this.marks = { along, up };
    this.axisNames();
  }

  axisNames() {
    const { ctx, palette, box } = this;
    ctx.textAlign = "left";
    ctx.fillStyle = palette.ink;
    ctx.strokeStyle = palette.ink;
    const below = typeset(ctx, this.names.x.name, 0, 0, 13, palette.serif, false);
    typeset(ctx, this.names.x.name, box.left + (box.width - below) / 2, box.top + box.height + 34, 13, palette.serif);
    const beside = typeset(ctx, this.names.y.name, 0, 0, 13, palette.serif, false);
    const size = 13 * Math.min(1, (this.height - 4) / Math.max(beside, 1)); // a low picture has a small name, none that is cut
    const length = (beside * size) / 13;
    ctx.save();
    ctx.translate(15, Math.max(length + 2, Math.min(box.top + (box.height + length) / 2, this.height - 2)));
    ctx.rotate(-Math.PI / 2);
    typeset(ctx, this.names.y.name, 0, 0, size, palette.serif);
    ctx.restore();
  }

  /** The frame with its ticks, which point inwards on all four sides. */
  frame() {
    const { ctx, palette, box } = this;
    ctx.strokeStyle = palette.ink;
    ctx.lineWidth = 0.8;
    ctx.setLineDash([]);
    ctx.strokeRect(box.left, box.top, box.width, box.height);
    ctx.beginPath();
    for (const value of this.marks?.along.values ?? []) {
      for (const [from, to] of [[box.top, box.top + 4], [box.top + box.height, box.top + box.height - 4]]) {
        ctx.moveTo(this.x(value), from);
        ctx.lineTo(this.x(value), to);
      }
    }
    for (const value of this.marks?.up.values ?? []) {
      for (const [from, to] of [[box.left, box.left + 4], [box.left + box.width, box.left + box.width - 4]]) {
        ctx.moveTo(from, this.y(value));
        ctx.lineTo(to, this.y(value));
      }
    }
    ctx.stroke();
  }

  /** @param {Line} line */
  pen(line) {
    const { ctx } = this;
    ctx.strokeStyle = line.color;
    ctx.lineWidth = line.width;
    ctx.globalAlpha = line.alpha ?? 1;
    ctx.setLineDash(line.dash ?? []);
    const thin = line.width <= THIN; // its joins are not seen, and round ones take most of the time of drawing
    ctx.lineJoin = thin ? "bevel" : "round";
    ctx.lineCap = thin || line.dash ? "butt" : "round";
  }

  /** A line through points; a point that is not finite interrupts it. @param {ArrayLike<number>} xs @param {ArrayLike<number>} ys @param {Line} line */
  curve(xs, ys, line) {
    this.pen(line);
    const { ctx } = this;
    ctx.beginPath();
    let open = false;
    let [left, top] = [0, 0];
    const piece = ctx.canvas && !line.dash?.length ? PIECE : Infinity; // a file has one path, and dashes go on
    let count = 0;
    for (let i = 0; i < xs.length; i++) {
      const x = clamp(this.x(/** @type {number} */ (xs[i])), -1e5, 1e5);
      const y = clamp(this.y(/** @type {number} */ (ys[i])), -1e5, 1e5);
      const there = Number.isFinite(x) && Number.isFinite(y);
      if (there && open && i < xs.length - 1 && Math.abs(x - left) < UNSEEN && Math.abs(y - top) < UNSEEN) continue;
      if (there && open) ctx.lineTo(x, y);
      else if (there) ctx.moveTo(x, y);
      if (there && open && ++count === piece) {
        ctx.stroke();
        ctx.beginPath();
        ctx.moveTo(x, y);
        count = 0;
      }
      [open, left, top] = [there, x, y];
    }
    ctx.stroke();
    ctx.globalAlpha = 1;
  }

  /** Small discs. @param {ArrayLike<number>} xs @param {ArrayLike<number>} ys @param {string} color @param {number} radius */
  dots(xs, ys, color, radius) {
    const { ctx } = this;
    ctx.fillStyle = color;
    ctx.beginPath();
    for (let i = 0; i < xs.length; i++) {
      const x = this.x(/** @type {number} */ (xs[i]));
      const y = this.y(/** @type {number} */ (ys[i]));
      if (!Number.isFinite(x + y) || Math.abs(x) > 1e5 || Math.abs(y) > 1e5) continue;
      ctx.moveTo(x + radius, y);
      ctx.arc(x, y, radius, 0, 2 * Math.PI);
    }
    ctx.fill();
  }

  /** A mark: a filled disc with a rim of the paper's colour. @param {number} x @param {number} y @param {string} color @param {number} radius */
  mark(x, y, color, radius = 5) {
    this.dots([x], [y], this.palette.paper, radius + 1.5);
    this.dots([x], [y], color, radius);
  }

  /** A special point: a shape, with a rim of the paper's colour. @param {number} x @param {number} y @param {[number, number][]} corners @param {number} radius */
  special(x, y, corners, radius = 4) {
    const [left, top] = [this.x(x), this.y(y)];
    if (!Number.isFinite(left + top) || Math.abs(left) > 1e5 || Math.abs(top) > 1e5) return;
    for (const [color, size] of /** @type {[string, number][]} */ ([[this.palette.paper, radius + 1.6], [this.palette.ink, radius]])) {
      this.ctx.fillStyle = color;
      this.ctx.beginPath();
      corners.forEach(([dx, dy], i) => (i ? this.ctx.lineTo(left + size * dx, top + size * dy) : this.ctx.moveTo(left + size * dx, top + size * dy)));
      this.ctx.closePath();
      this.ctx.fill();
    }
  }

  /** An open circle. @param {number} x @param {number} y @param {string} color @param {number} radius */
  ring(x, y, color, radius = 5) {
    if (!Number.isFinite(this.x(x) + this.y(y))) return;
    this.pen({ color, width: 1.5 });
    this.ctx.beginPath();
    this.ctx.arc(this.x(x), this.y(y), radius, 0, 2 * Math.PI);
    this.ctx.stroke();
  }

  /** @param {number} x @param {Line} line */
  vertical(x, line) {
    this.curve([x, x], [this.window[2], this.window[3]], line);
  }

  /** @param {number} y @param {Line} line */
  horizontal(y, line) {
    this.curve([this.window[0], this.window[1]], [y, y], line);
  }

  /** @param {number} x @param {number} y */
  cross(x, y) {
    const line = { color: this.palette.soft, width: 0.6, dash: [2, 2] };
    this.vertical(x, line);
    this.horizontal(y, line);
  }

  /** A sentence in the middle of an empty picture. @param {string} text */
  say(text) {
    const { ctx, palette } = this;
    ctx.font = `14px ${palette.sans}`;
    ctx.fillStyle = palette.soft;
    ctx.textAlign = "center";
    ctx.textBaseline = "middle";
    const lines = wrapped(ctx, text, Math.min(this.width - 40, 420));
    lines.forEach((line, i) => ctx.fillText(line, this.width / 2, this.height / 2 + (i - (lines.length - 1) / 2) * 20));
    ctx.textBaseline = "alphabetic";
  }
}

/** @param {any} ctx @param {string} text @param {number} width */
function wrapped(ctx, text, width) {
  /** @type {string[]} */
  const lines = [];
  let line = "";
  for (const word of text.split(" ")) {
    const longer = line ? `${line} ${word}` : word;
    if (line && ctx.measureText(longer).width > width) {
      lines.push(line);
      line = word;
    } else line = longer;
  }
  return line ? [...lines, line] : lines;
}

/** An axis's name for a readout, and a value with all digits the pointer has. @param {Axis} axis @param {number} value */
export function reading(axis, value) {
  const name = axis.name.map((part) => (typeof part === "string" ? part : asText(part))).join("");
  return `${name.replace(/\s*\(.*\)$/, "")} = ${shortly(value, 6)}`;
}
