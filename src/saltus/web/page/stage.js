/** The mechanism, drawn at the time that is shown: its shapes, a flash at impacts, and whether the model is to be believed. */

import { currentPalette } from "./palette.js";
import { isDrawn, pictureOf } from "./drawings.js";
import { rangeOf, shortly } from "./numbers.js";
import { asText, symbolOf } from "./symbols.js";

/** @typedef {import("./types.js").Shape} Shape */
/** @typedef {import("./palette.js").Palette} Palette */
/** @typedef {[number, number, number, number]} Box */

const OWN_STATES = 60; // of a motion, around which the picture of a model's own drawing is laid
const MOST_READ = 600; // instants of a motion at which the points of a structure are read
const HALF_MASS = 0.16; // of the width of a mass that is drawn on a line
const MOST_LINES = 6;
const MOST_LABELLED = 12; // points of a structure whose names are all written
const FLASH_TIME = 0.22; // seconds of the reader for which an impact is seen

/** @typedef {{fill?: string, stroke?: string, width?: number, dash?: number[]}} Ink */

/** How each part of a mechanism looks. @param {Palette} p @returns {Record<string, Ink>} */
function inks(p) {
  return {
    bar: { stroke: p.bar, width: 4 }, slider: { stroke: p.ink, width: 3 }, hinge: { fill: p.paper, stroke: p.ink, width: 1.2 },
    mass: { fill: p.ink }, body: { fill: p.pale, stroke: p.ink, width: 1.4 }, hollow: { fill: p.paper, stroke: p.ink, width: 1 },
    spring: { stroke: p.stable, width: 1.4 }, coupling: { stroke: p.stable, width: 1.2 }, thin: { stroke: p.ink, width: 1 },
    ground: { stroke: p.ink, width: 1.6 }, hatch: { stroke: p.soft, width: 0.8 }, support: { fill: p.paper, stroke: p.ink, width: 1.2 },
    wall: { fill: p.soft, stroke: p.ink, width: 1.2 }, wheel: { fill: p.paper, stroke: p.ink, width: 1.4 },
    ghost: { stroke: p.separatrix, width: 1, dash: [4, 3] }, closed: { stroke: p.limit, width: 1.2, dash: [2, 3] },
    load: { stroke: p.unstable, fill: p.unstable, width: 2 }, point: { fill: p.stable }, trail: { stroke: p.separatrix, width: 1 },
  };
}

export class Stage {
  /** @param {HTMLElement} host @param {import("./session.js").Session} session */
  constructor(host, session) {
    this.session = session;
    this.canvas = document.createElement("canvas");
    this.canvas.setAttribute("role", "img");
    host.append(this.canvas);
    this.host = host;
    this.note = "";
    /** @type {number[]} */
    this.reach = [];
    /** How far any of the points of a structure moves. */
    this.pointReach = 0;
    /** @type {Box|null} */
    this.ownBox = null;
    this.spoken = 0;
    this.size = sizeOf(host);
    new ResizeObserver(() => {
      this.size = sizeOf(host);
      this.draw();
    }).observe(host);
  }

  /** How far the motion reaches in each coordinate, from its curve. */
  measure() {
    this.reach = this.session.coordinates.map(({ name }) => {
      const range = rangeOf([this.session.column(name)]);
      return range ? Math.max(Math.abs(range.low), Math.abs(range.high)) : 1;
    });
    this.ownBox = this.boxOfOwn();
    const { description, curve } = this.session;
    const every = Math.ceil(curve.length / MOST_READ) || 1;
    const columns = this.session.coordinates.map(({ name }) => this.session.column(name));
    this.pointReach = 0;
    const moved = new Float64Array(Math.ceil(curve.length / every));
    for (const { weights } of description.model.points ?? []) {
      moved.fill(0);
      weights.forEach((weight, k) => {
        const column = columns[k] ?? moved;
        if (weight) for (let i = 0; i < moved.length; i++) moved[i] = (moved[i] ?? 0) + weight * (column[i * every] ?? 0);
      });
      for (const each of moved) this.pointReach = Math.max(this.pointReach, Math.abs(each));
    }
  }

  /** Around the model's own drawing, wherever the motion goes. @returns {Box|null} */
  boxOfOwn() {
    const { engine, system, motion } = this.session;
    if (!system || !motion) return null;
    const { first, last } = motion.time;
    const times = Array.from({ length: OWN_STATES }, (_, i) => first + ((last - first) * i) / (OWN_STATES - 1));
    const shapes = times.flatMap((time) => engine.drawing?.(system, motion.state(time), time) ?? []);
    return shapes.length ? boxOf(shapes) : null;
  }

  /** The impact that is flashing at a time, and how strongly: 1 at the impact, then fading. @param {number} time */
  flashAt(time) {
    const { store, motion } = this.session;
    const lasting = FLASH_TIME * Math.max(store.state.speed, 1e-9);
    const events = motion?.events ?? [];
    let [low, high] = [0, events.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (/** @type {any} */ (events[middle]).time <= time + 1e-12) low = middle + 1;
      else high = middle;
    }
    const event = events[low - 1];
    if (!event || event.kind !== "impact" || time - event.time > lasting) return null;
    return { event, strength: 1 - (time - event.time) / lasting };
  }

  draw() {
    const ratio = globalThis.devicePixelRatio || 1;
    const [width, height] = this.size;
    if (!width || !height) return;
    if (this.canvas.width !== Math.round(width * ratio) || this.canvas.height !== Math.round(height * ratio)) {
      this.canvas.width = Math.round(width * ratio);
      this.canvas.height = Math.round(height * ratio);
    }
    const ctx = /** @type {CanvasRenderingContext2D} */ (this.canvas.getContext("2d"));
    ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.paint(ctx, width, height, currentPalette());
  }

  /** @param {any} ctx @param {number} width @param {number} height @param {Palette} palette */
  paint(ctx, width, height, palette) {
    ctx.fillStyle = palette.paper;
    ctx.fillRect(0, 0, width, height);
    const { cursor } = this.session.store.state;
    const picture = this.pictureAt(cursor);
    this.note = picture?.note ?? "";
    if (!picture) return;
    const place = placing(picture.box, width, height);
    const flash = this.flashAt(cursor);
    const styles = inks(palette);
    if (flash) for (const role of ["mass", "body"]) styles[role] = { ...styles[role], fill: palette.flash };
    for (const shape of picture.shapes) paintShape(ctx, shape, place, styles[shape.role] ?? styles.thin ?? {});
    if (flash) halo(ctx, width, height, palette.flash, flash.strength);
    this.describe();
  }

  /** @param {number} time @returns {import("./drawings.js").Picture|null} */
  pictureAt(time) {
    const { session } = this;
    const { description, system, engine } = session;
    const state = session.stateAt(time);
    if (!state || !system) return null;
    const own = engine.drawing?.(system, state, time);
    if (own?.length) return { shapes: own, box: this.ownBox ?? boxOf(own) };
    const channels = [...new Set(description.load.map((entry) => entry.channel))];
    const load = (/** @type {string} */ channel) => (channels.includes(channel) ? session.load(channel, time) : 0);
    const scene = { values: session.store.state.values, state, time, reach: this.reach, load, channels };
    return isDrawn(description.model.name) ? pictureOf(description.model.name, scene) : this.undrawn(state);
  }

  /** A model without a drawing: a structure by its points, another one by its coordinates. @param {ArrayLike<number>} state */
  undrawn(state) {
    const points = this.session.description.model.points ?? [];
    if (points.length < 2) return this.point(state);
    const moved = points.map(({ weights }) => displacement(weights, (k) => state[k] ?? 0));
    const stops = this.stops().map((stop) => ({ ...stop, point: points.findIndex(({ weights }) => isUnit(weights, stop.coordinate)) }));
    return pointsInARow(points, moved, stops.filter(({ point }) => point >= 0), this.pointReach);
  }

  /** A model without a drawing: a point on a line for each coordinate. @param {ArrayLike<number>} state */
  point(state) {
    const stops = this.stops();
    const drawn = rowsOf(this.session.coordinates, stops);
    const count = drawn.length;
    const shapes = drawn.flatMap((i, line) => {
      const y = (count - 1) / 2 - line;
      const own = stops.filter((stop) => stop.coordinate === i);
      if (own.length) return massAtStops(state[i] ?? 0, y, own, this.reach[i] || 1);
      const reach = this.reach[i] || 1;
      return [
        { kind: "line", points: [[-1.2, y], [1.2, y]], role: "thin" },
        { kind: "line", points: [[0, y - 0.06], [0, y + 0.06]], role: "thin" },
        { kind: "circle", points: [[(state[i] ?? 0) / reach, y]], radius: 0.06, role: "point" },
      ];
    });
    /** @type {Box} */
    const box = [-1.5, 1.5, -Math.max(count / 2, 0.8), Math.max(count / 2, 0.8)];
    return { shapes, box };
  }

  /** The stops of the model where the present numbers put them. @returns {{coordinate: number, side: number, position: number}[]} */
  stops() {
    const { values } = this.session.store.state;
    return (this.session.description.model.stops ?? []).map(({ coordinate, side, position, slopes, base }) => ({
      coordinate, side,
      position: Object.entries(slopes).reduce((sum, [path, slope]) => sum + slope * ((values[path] ?? 0) - (base[path] ?? 0)), position),
    }));
  }

  /** The drawing in words, for those who do not see it; not more than once a second. */
  describe() {
    const now = Date.now();
    if (now - this.spoken < 1000) return;
    this.spoken = now;
    const { session } = this;
    const state = session.stateAt(session.store.state.cursor);
    const parts = session.coordinates.map(({ name, unit }, i) => `${name} ${shortly(state?.[i] ?? NaN, 4)} ${unit === "1" ? "" : unit}`);
    const text = `The mechanism of ${session.description.model.name} at time ${shortly(session.store.state.cursor, 5)}: ${parts.join(", ")}`;
    this.canvas.setAttribute("aria-label", text);
  }
}

/** The coordinates that are drawn: those with a stop alone, where the others are modes or many. @param {{name: string}[]} coordinates @param {{coordinate: number}[]} stops */
function rowsOf(coordinates, stops) {
  const all = coordinates.map((_, i) => i);
  const few = coordinates.length <= MOST_LINES && !coordinates.some(({ name }) => /^mode_\d+$/.test(name));
  return stops.length && !few ? all.filter((i) => stops.some((stop) => stop.coordinate === i)) : all;
}

/** @param {number[]} weights @param {(coordinate: number) => number} coordinate */
function displacement(weights, coordinate) {
  return weights.reduce((sum, weight, k) => sum + (weight ? weight * coordinate(k) : 0), 0);
}

/** Whether a point is a coordinate itself. @param {number[]} weights @param {number} coordinate */
function isUnit(weights, coordinate) {
  return weights.every((weight, k) => Math.abs(weight - Number(k === coordinate)) < 1e-9);
}

/**
 * The points of a structure side by side, each as far above or below a line as it is displaced, and its stops where they are.
 * @param {import("./types.js").StructurePoint[]} points @param {number[]} moved @param {{point: number, side: number, position: number}[]} stops @param {number} reach
 */
function pointsInARow(points, moved, stops, reach) {
  const unit = Math.max(reach, ...stops.map(({ position }) => Math.abs(position))) || 1;
  const pitch = Math.min(0.8, 3.6 / (points.length - 1));
  const half = Math.min(0.14, 0.34 * pitch);
  const x = (/** @type {number} */ i) => (i - (points.length - 1) / 2) * pitch;
  const y = (/** @type {number} */ i) => (moved[i] ?? 0) / unit;
  const wide = x(points.length - 1) + 0.35;
  /** @type {Shape[]} */
  const shapes = [{ kind: "line", points: [[-wide, 0], [wide, 0]], role: "thin" }];
  points.forEach(({ tie }, i) => {
    if (tie) shapes.push({ kind: "line", points: [[x(i - 1), y(i - 1)], [x(i), y(i)]], role: tie === "spring" ? "spring" : "ghost" });
  });
  for (const { point, side, position } of stops) {
    const face = position / unit + side * half;
    const ends = [[-1.3, 0], [1.3, 0], [1.3, 1], [-1.3, 1]].map(([a, b]) => [x(point) + (a ?? 0) * half, face + side * 0.08 * (b ?? 0)]);
    shapes.push({ kind: "polygon", points: ends, role: "wall" });
  }
  const low = -1.5 - half;
  points.forEach(({ name }, i) => {
    const square = [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([a, b]) => [x(i) + (a ?? 0) * half, y(i) + (b ?? 0) * half]);
    shapes.push({ kind: "polygon", points: square, role: "mass" });
    if (points.length <= MOST_LABELLED || stops.some(({ point }) => point === i)) shapes.push({ kind: "text", points: [[x(i), low]], role: "thin", text: asText(symbolOf(name)) });
  });
  /** @type {Box} */
  const box = [-Math.max(wide, 1.5), Math.max(wide, 1.5), low - 0.2, 1.25 + half];
  return { shapes, box };
}

/** A mass on a line between its stops, in lengths of the larger of its reach and theirs. @param {number} x @param {number} y @param {{side: number, position: number}[]} stops @param {number} reach @returns {Shape[]} */
function massAtStops(x, y, stops, reach) {
  const unit = Math.max(reach, ...stops.map(({ position }) => Math.abs(position))) || 1;
  const at = x / unit;
  const low = y - HALF_MASS;
  const walls = stops.map(({ side, position }) => {
    const face = position / unit + side * HALF_MASS;
    const ends = [[face, low], [face + side * 0.07, low], [face + side * 0.07, y + 0.3], [face, y + 0.3]];
    return { kind: "polygon", points: ends, role: "wall" };
  });
  const corners = [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([a, b]) => [at + (a ?? 0) * HALF_MASS, y + (b ?? 0) * HALF_MASS]);
  return [
    { kind: "line", points: [[-1.4, low], [1.4, low]], role: "ground" },
    { kind: "line", points: [[0, low - 0.06], [0, low]], role: "thin" },
    ...walls, { kind: "polygon", points: corners, role: "mass" },
  ];
}

/** @param {HTMLElement} host @returns {[number, number]} */
function sizeOf(host) {
  const box = host.getBoundingClientRect();
  return [Math.round(box.width), Math.round(box.height)];
}

/** Where a box of the mechanism stands in a picture, with equal scales. @param {Box} box @param {number} width @param {number} height */
export function placing(box, width, height) {
  const [x0, x1, y0, y1] = box;
  const scale = Math.min(width / (x1 - x0), height / (y1 - y0));
  const left = (width - scale * (x1 - x0)) / 2 - scale * x0;
  const bottom = (height + scale * (y1 - y0)) / 2 + scale * y0;
  return { scale, x: (/** @type {number} */ x) => left + scale * x, y: (/** @type {number} */ y) => bottom - scale * y };
}

/** @param {Shape[]} shapes @returns {Box} */
function boxOf(shapes) {
  const points = shapes.flatMap((shape) => shape.points);
  const x = rangeOf([points.map((point) => point[0] ?? NaN)]) ?? { low: -1, high: 1 };
  const y = rangeOf([points.map((point) => point[1] ?? NaN)]) ?? { low: -1, high: 1 };
  const room = 0.2 * Math.max(x.high - x.low, y.high - y.low, 1);
  return [x.low - room, x.high + room, y.low - room, y.high + room];
}

/** @param {any} ctx @param {Shape} shape @param {ReturnType<typeof placing>} place @param {Ink} ink */
export function paintShape(ctx, shape, place, ink) {
  const points = shape.points.map(([x, y]) => [place.x(x ?? 0), place.y(y ?? 0)]);
  if (!points.length || !points.flat().every(Number.isFinite)) return;
  if (shape.kind === "text") return written(ctx, shape.text ?? "", points[0] ?? [0, 0], ink.stroke ?? "");
  ctx.lineWidth = Math.min(ink.width ?? 1, Math.max(0.6, ((ink.width ?? 1) * place.scale) / 70));
  ctx.setLineDash(ink.dash ?? []);
  ctx.lineCap = "round";
  ctx.lineJoin = "round";
  ctx.beginPath();
  if (shape.kind === "circle" || shape.kind === "point") disc(ctx, points[0] ?? [0, 0], shape, place.scale);
  else points.forEach(([x, y], i) => (i ? ctx.lineTo(x, y) : ctx.moveTo(x, y)));
  if (shape.kind === "polygon") ctx.closePath();
  const filled = ["circle", "point", "polygon"].includes(shape.kind);
  if (filled && ink.fill) fillWith(ctx, ink.fill);
  if (ink.stroke) strokeWith(ctx, ink.stroke);
  if (shape.kind === "arrow") head(ctx, points[0] ?? [0, 0], points[1] ?? [0, 0], ink.fill ?? "");
  ctx.setLineDash([]);
}

/** @param {any} ctx @param {number[]} at @param {Shape} shape @param {number} scale */
function disc(ctx, at, shape, scale) {
  ctx.arc(at[0], at[1], Math.max(shape.kind === "point" ? 5 : (shape.radius ?? 0.05) * scale, 1), 0, 2 * Math.PI);
}

/** @param {any} ctx @param {string} text @param {number[]} at @param {string} color */
function written(ctx, text, at, color) {
  ctx.font = "13px serif";
  ctx.fillStyle = color;
  ctx.textAlign = "center";
  ctx.fillText(text, at[0], at[1]);
}

/** @param {any} ctx @param {string} color */
function fillWith(ctx, color) {
  ctx.fillStyle = color;
  ctx.fill();
}

/** @param {any} ctx @param {string} color */
function strokeWith(ctx, color) {
  ctx.strokeStyle = color;
  ctx.stroke();
}

/** @param {any} ctx @param {number[]} from @param {number[]} to @param {string} color */
function head(ctx, from, to, color) {
  const [x, y] = [to[0] ?? 0, to[1] ?? 0];
  const angle = Math.atan2(y - (from[1] ?? 0), x - (from[0] ?? 0));
  ctx.fillStyle = color;
  ctx.beginPath();
  ctx.moveTo(x + 5 * Math.cos(angle), y + 5 * Math.sin(angle));
  for (const side of [2.6, -2.6]) ctx.lineTo(x + 8 * Math.cos(angle + side), y + 8 * Math.sin(angle + side));
  ctx.closePath();
  ctx.fill();
}

/** @param {any} ctx @param {number} width @param {number} height @param {string} color @param {number} strength */
function halo(ctx, width, height, color, strength) {
  ctx.globalAlpha = strength;
  ctx.strokeStyle = color;
  ctx.lineWidth = 4;
  ctx.strokeRect(2, 2, width - 4, height - 4);
  ctx.globalAlpha = 1;
}
