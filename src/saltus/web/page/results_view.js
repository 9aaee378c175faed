/** Results of Python laid over the page: diagrams, charts, basins and curves; what a click and the arrow keys choose in them. */

import { allDigits, clamp, rangeOf, shortly } from "./numbers.js";
import { parameterName, parameterSymbol } from "./symbols.js";
import { branchLine } from "./palette.js";
import { cornersOf, isAbbreviated } from "./plot.js";

/** @typedef {import("./types.js").ResultEntry} ResultEntry */
/** @typedef {import("./types.js").ResultBranch} ResultBranch */
/** @typedef {import("./session.js").Session} Session */
/** @typedef {import("./plot.js").Painter} Painter */
/** @typedef {import("./plot.js").Plot} Plot */
/** @typedef {import("./views.js").View} View */

const TAKES = 24; // pixels within which a click takes hold of a branch

/** The results that belong to this system, and a sentence for each that does not. @param {ResultEntry[]} results @param {string} digest */
export function ofThisSystem(results, digest) {
  const own = results.filter((result) => result.digest === digest);
  const refused = results.filter((result) => result.digest !== digest);
  return { own, refused: refused.map(({ title }) => `${title} is a result of another system and is not shown.`) };
}

/** The numbers of a result that are not those of the page, but for the parameters along its axes. @param {ResultEntry} result @param {Record<string, number>} values */
export function differing(result, values) {
  const along = [result.path, ...(result.paths ?? [])];
  return Object.entries(result.values ?? {}).filter(([path, value]) => !along.includes(path) && path in values && values[path] !== value);
}

/** What is said where a result is of other numbers than the page has now. @param {ResultEntry} result @param {Record<string, number>} values */
export function differingSaid(result, values) {
  const other = differing(result, values);
  if (!other.length) return "";
  return `Computed for ${other.map(([path, value]) => `${parameterName(path)} = ${allDigits(value)}`).join(", ")}; a click sets these numbers.`;
}

/** A parameter's axis. @param {string} path */
function parameterAxis(path) {
  const symbol = parameterSymbol(path);
  return { name: [`${parameterName(path)} `, ...(symbol ? [symbol] : [])] };
}

/**
 * The view of one result with axes of parameters.
 * @param {Session} session @param {() => ResultEntry|null} shown @param {Choice} choice @returns {View}
 */
export function resultView(session, shown, choice) {
  const of = (/** @type {(result: ResultEntry) => any} */ use) => {
    const result = shown();
    return result ? use(result) : null;
  };
  return {
    id: "result", title: "Results of Python",
    instructions: "A click takes a point with its parameter and its orbit; the arrow keys step along a branch.",
    axes: () => of(axesOf) ?? { x: { name: [""] }, y: { name: [""] } },
    bounds: () => of(boundsOf),
    empty: () => "There is no result to show.",
    paint: (painter) => of((result) => {
      painter.fade = differing(result, session.store.state.values).length > 0;
      return result.kind === "diagram" ? paintDiagram(painter, result) : paintChart(painter, result);
    }),
    over: (painter) => of((result) => paintChosen(painter, result, session)),
    act: (x, y, plot) => of((result) => (result.kind === "diagram" ? choice.nearest(result, x, y, plot) : choice.cell(result, x, y))),
    read: (x, y, plot) => of((result) => (result.kind === "diagram" ? readDiagram(result, x, y, plot) : readChart(result, x, y))),
    key: (key) => of((result) => choice.key(result, key)) ?? false,
    csv: () => of(columnsOf) ?? {},
  };
}

/** @param {ResultEntry} result */
function axesOf(result) {
  if (result.kind === "diagram") return { x: parameterAxis(result.path ?? ""), y: { name: [result.quantity ?? "amplitude"] } };
  const [first, second] = result.paths ?? ["", ""];
  return { x: parameterAxis(first ?? ""), y: parameterAxis(second ?? "") };
}

/** All of a result; of a diagram what lies in the range of its study. @param {ResultEntry} result @returns {import("./plot.js").Window|null} */
export function boundsOf(result) {
  const [low, high] = result.bounds ?? [-Infinity, Infinity];
  const parts = [...(result.branches ?? []), ...(result.dots ? [result.dots] : [])].map(({ parameter, amplitude }) => {
    const inside = parameter.flatMap((value, i) => (value >= low && value <= high ? [i] : []));
    return { xs: inside.map((i) => parameter[i] ?? NaN), ys: inside.map((i) => amplitude[i] ?? NaN) };
  });
  const x = rangeOf([...parts.map(({ xs }) => xs), result.x ?? [], result.bounds ?? []]);
  const y = rangeOf([...parts.map(({ ys }) => ys), result.y ?? []]);
  return x && y ? [x.low, x.high, y.low, y.high] : null;
}

/** @param {Painter} painter @param {ResultEntry} result */
function paintDiagram(painter, result) {
  const { palette } = painter;
  for (const { low, high } of result.bands ?? []) {
    painter.ctx.globalAlpha = 0.5;
    painter.ctx.fillStyle = palette.pale;
    painter.ctx.fillRect(painter.x(low), painter.box.top, painter.x(high) - painter.x(low), painter.box.height);
    painter.ctx.globalAlpha = 1;
  }
  if (result.dots) painter.dots(result.dots.parameter, result.dots.amplitude, palette.separatrix, 1.5);
  for (const branch of result.branches ?? []) {
    for (const [from, to] of runs(branch.stable)) {
      painter.curve(branch.parameter.slice(from, to + 1), branch.amplitude.slice(from, to + 1), { ...branchLine(palette, Boolean(branch.stable[from])), alpha: painter.fade ? 0.35 : 1 });
    }
  }
  const shapes = shapesOf(result);
  for (const { kind, parameter, amplitude } of result.special ?? []) painter.special(parameter, amplitude, shapes.get(kind) ?? []);
}

/** The corners of the marks of each kind of special points that a result has. @param {ResultEntry} result @returns {Map<string, [number, number][]>} */
export function shapesOf(result) {
  const kinds = [...new Set((result.special ?? []).map(({ kind }) => kind))];
  const own = kinds.filter((kind) => !isAbbreviated(kind));
  return new Map(kinds.map((kind) => [kind, cornersOf(kind, own.indexOf(kind))]));
}

/** What the marks of a diagram mean, and how many there are. @param {HTMLElement} host @param {ResultEntry|null|undefined} result */
export function specialLegend(host, result) {
  const special = result?.special ?? [];
  const shapes = result ? [...shapesOf(result)] : [];
  host.replaceChildren(...shapes.map(([kind, corners]) => {
    const item = document.createElement("li");
    const shape = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    const outline = document.createElementNS("http://www.w3.org/2000/svg", "polygon");
    shape.setAttribute("viewBox", "-1 -1 2 2");
    shape.setAttribute("aria-hidden", "true");
    outline.setAttribute("points", corners.map((corner) => corner.join(",")).join(" "));
    shape.append(outline);
    const of = special.filter((each) => each.kind === kind);
    item.append(shape, `${of[0]?.text}${isAbbreviated(kind) ? ` (${kind})` : ""}, ${of.length}`);
    return item;
  }));
}

/** Stretches of a branch of one stability; each reaches to the first point of the next. @param {number[]} stable */
export function runs(stable) {
  /** @type {[number, number][]} */
  const found = [];
  for (let from = 0, i = 1; i <= stable.length; i++) {
    if (i < stable.length && Boolean(stable[i]) === Boolean(stable[from])) continue;
    found.push([from, Math.min(i, stable.length - 1)]);
    from = i;
  }
  return found;
}

/** @param {Painter} painter @param {ResultEntry} result */
function paintChart(painter, result) {
  const [xs, ys, cells] = [result.x ?? [], result.y ?? [], result.cells ?? []];
  const most = cells.flat().reduce((/** @type {number} */ high, value) => Math.max(high, value ?? 0), 1e-300);
  const { ctx } = painter;
  xs.forEach((_, i) => {
    const [left, right] = edges(xs, i);
    ys.forEach((_y, k) => {
      const value = cells[i]?.[k];
      if (value == null) return;
      const [low, high] = edges(ys, k);
      ctx.globalAlpha = painter.fade ? 0.35 : 1;
      ctx.fillStyle = shade(value / most);
      fillCell(painter, left, right, low, high);
    });
  });
  ctx.globalAlpha = 1;
  for (const { stable, points } of result.curves ?? []) {
    painter.curve(points.map((p) => p[0] ?? NaN), points.map((p) => p[1] ?? NaN), { ...branchLine(painter.palette, stable), width: 1.2 });
  }
}

/** Fill a cell up to whole pixels, so that neighbours neither overlap nor leave a line between them. @param {Painter} painter @param {number} left @param {number} right @param {number} low @param {number} high */
function fillCell(painter, left, right, low, high) {
  const [x0, x1, y0, y1] = [painter.x(left), painter.x(right), painter.y(high), painter.y(low)].map(Math.round);
  painter.ctx.fillRect(x0, y0, /** @type {number} */ (x1) - /** @type {number} */ (x0), /** @type {number} */ (y1) - /** @type {number} */ (y0));
}

/** The borders of a cell: amid its value and the next ones. @param {number[]} values @param {number} i @returns {[number, number]} */
function edges(values, i) {
  const at = (/** @type {number} */ k) => values[k] ?? NaN;
  const before = i > 0 ? (at(i - 1) + at(i)) / 2 : at(0) - (at(1) - at(0)) / 2;
  const after = i < values.length - 1 ? (at(i) + at(i + 1)) / 2 : at(i) + (at(i) - at(i - 1)) / 2;
  return [before, after];
}

/** A colour from light to dark that rises evenly in lightness, for numbers from 0 to 1 (after cividis). @param {number} share */
export function shade(share) {
  const s = clamp(share, 0, 1);
  const stops = [[253, 231, 140], [190, 176, 110], [124, 123, 120], [66, 78, 108], [0, 34, 78]];
  const place = s * (stops.length - 1);
  const i = Math.min(Math.floor(place), stops.length - 2);
  const mixed = [0, 1, 2].map((k) => Math.round((stops[i]?.[k] ?? 0) + (place - i) * ((stops[i + 1]?.[k] ?? 0) - (stops[i]?.[k] ?? 0))));
  return `rgb(${mixed.join(",")})`;
}

/** @param {Painter} painter @param {ResultEntry} result @param {Session} session */
function paintChosen(painter, result, session) {
  const { selected, values } = session.store.state;
  const line = { color: painter.palette.separatrix, width: 0.8, dash: [2, 3] };
  if (result.kind === "diagram") {
    painter.vertical(values[result.path ?? ""] ?? NaN, line);
    const branch = selected ? result.branches?.[selected.branch] : null;
    if (branch && selected) {
      const stable = Boolean(branch.stable[selected.point]);
      painter.mark(branch.parameter[selected.point] ?? NaN, branch.amplitude[selected.point] ?? NaN, stable ? painter.palette.stable : painter.palette.unstable, 5.5);
    }
  } else if (result.paths) {
    const [x, y] = result.paths.map((path) => values[path] ?? NaN);
    painter.mark(x ?? NaN, y ?? NaN, painter.palette.unstable, 5);
  }
}

/** The point of all branches that is nearest on the screen. @param {ResultEntry} result @param {number} x @param {number} y @param {Plot} plot */
export function nearestPoint(result, x, y, plot) {
  const [x0, x1, y0, y1] = plot.seen();
  let best = { branch: -1, point: -1, distance: TAKES * TAKES };
  (result.branches ?? []).forEach((each, branch) => {
    each.parameter.forEach((parameter, point) => {
      const [dx, dy] = [((parameter - x) / (x1 - x0)) * plot.width, (((each.amplitude[point] ?? NaN) - y) / (y1 - y0)) * plot.height];
      const distance = dx * dx + dy * dy;
      if (distance < best.distance) best = { branch, point, distance };
    });
  });
  return best.branch < 0 ? null : best;
}

/** @param {ResultEntry} result @param {number} x @param {number} y @param {Plot} plot */
function readDiagram(result, x, y, plot) {
  const found = nearestPoint(result, x, y, plot);
  const special = (result.special ?? []).find((each) => Math.abs(each.parameter - (result.branches?.[found?.branch ?? -1]?.parameter[found?.point ?? -1] ?? NaN)) < 1e-12);
  if (found) return `${orbitSaid(result, found.branch, found.point)}${special ? `; ${special.text}` : ""}`;
  return `${parameterName(result.path ?? "")} = ${shortly(x)}, ${result.quantity ?? "amplitude"} = ${shortly(y)}`;
}

/** An orbit of a branch in words. @param {ResultEntry} result @param {number} branch @param {number} point */
export function orbitSaid(result, branch, point) {
  const found = result.branches?.[branch];
  if (!found || point >= found.parameter.length) return "";
  const multipliers = (found.multipliers?.[point] ?? []).map(([re, im]) => (im ? `${shortly(re ?? 0)} ${im < 0 ? "−" : "+"} ${shortly(Math.abs(im))}i` : shortly(re ?? 0)));
  const parts = [
    `${parameterName(result.path ?? "")} = ${allDigits(found.parameter[point] ?? NaN)}`,
    `${result.quantity ?? "amplitude"} = ${allDigits(found.amplitude[point] ?? NaN)}`,
    `period ${found.period[point]}, ${found.stable[point] ? "stable" : "unstable"}`,
    multipliers.length ? `multipliers ${multipliers.join(", ")}` : "",
    found.evidence?.[point] ?? "",
  ];
  return parts.filter(Boolean).join("; ");
}

/** @param {ResultEntry} result @param {number} x @param {number} y */
function cellAt(result, x, y) {
  const index = (/** @type {number[]} */ values, /** @type {number} */ value) => values.findIndex((_, i) => value >= edges(values, i)[0] && value <= edges(values, i)[1]);
  const [i, k] = [index(result.x ?? [], x), index(result.y ?? [], y)];
  return i < 0 || k < 0 ? null : { i, k };
}

/** @param {ResultEntry} result @param {number} x @param {number} y */
function readChart(result, x, y) {
  const cell = cellAt(result, x, y);
  if (!cell) return null;
  const value = result.cells?.[cell.i]?.[cell.k];
  const where = (result.paths ?? []).map((path, n) => `${parameterName(path)} = ${(n ? result.y : result.x)?.[n ? cell.k : cell.i]}`);
  return `${where.join(", ")}: ${value == null ? "no stable motion beside rest" : `${result.quantity ?? "amplitude"} ${allDigits(value)}`}`;
}

/** @param {ResultEntry} result */
function columnsOf(result) {
  if (result.kind === "diagram") {
    const branches = result.branches ?? [];
    return {
      branch: branches.flatMap(({ parameter }, i) => parameter.map(() => i)), parameter: branches.flatMap(({ parameter }) => parameter),
      amplitude: branches.flatMap(({ amplitude }) => amplitude), stable: branches.flatMap(({ stable }) => stable.map(Number)),
      period: branches.flatMap(({ period }) => period),
    };
  }
  const [xs, ys] = [result.x ?? [], result.y ?? []];
  return { x: xs.flatMap((x) => ys.map(() => x)), y: xs.flatMap(() => ys), value: (result.cells ?? []).flat().map((value) => value ?? NaN) };
}

/** What is chosen in a result, and how the page follows. */
export class Choice {
  /** @param {Session} session @param {(numbers: Record<string, number>, start: Record<string, number>|null, periods: number|null) => void} show @param {() => number} index */
  constructor(session, show, index) {
    this.session = session;
    this.show = show;
    this.index = index;
  }

  /** @param {ResultEntry} result @param {number} x @param {number} y @param {Plot} plot */
  nearest(result, x, y, plot) {
    const found = nearestPoint(result, x, y, plot);
    if (found) this.orbit(result, found.branch, found.point);
  }

  /** Set the parameter and show an orbit over its own period. @param {ResultEntry} result @param {number} branch @param {number} point */
  orbit(result, branch, point) {
    const found = result.branches?.[branch];
    if (!found || !result.path) return;
    this.session.store.set({ selected: { result: this.index(), branch, point } });
    const numbers = { ...this.ownNumbers(result), [result.path]: found.parameter[point] ?? NaN };
    this.show(numbers, this.startFrom(found.start[point], found.time?.[point] ?? 0), found.period[point] ?? 1);
  }

  /** The numbers of a result's system that the page has. @param {ResultEntry} result */
  ownNumbers(result) {
    const { values } = this.session.store.state;
    return Object.fromEntries(Object.entries(result.values ?? {}).filter(([path]) => path in values));
  }

  /** @param {number[]|undefined|null} state @param {number} time */
  startFrom(state, time) {
    const { coordinates } = this.session;
    if (!state || state.length < 2 * coordinates.length) return null;
    /** @type {Record<string, number>} */
    const start = { time };
    coordinates.forEach(({ name, velocity }, i) => {
      start[name] = state[i] ?? 0;
      start[velocity] = state[i + coordinates.length] ?? 0;
    });
    return start;
  }

  /** Start the largest motion of a cell of a chart. @param {ResultEntry} result @param {number} x @param {number} y */
  cell(result, x, y) {
    const cell = cellAt(result, x, y);
    const [first, second] = result.paths ?? [];
    if (!cell || first === undefined || second === undefined) return;
    const numbers = { ...this.ownNumbers(result), [first]: result.x?.[cell.i] ?? NaN, [second]: result.y?.[cell.k] ?? NaN };
    this.show(numbers, this.startFrom(result.starts?.[cell.i]?.[cell.k], 0), null);
  }

  /** Arrow keys step along the branch that is chosen. @param {ResultEntry} result @param {string} key */
  key(result, key) {
    const { selected } = this.session.store.state;
    const way = { ArrowRight: 1, ArrowLeft: -1 }[key];
    const count = selected ? (result.branches?.[selected.branch]?.parameter.length ?? 0) : 0;
    if (!way || !selected || !count || result.kind !== "diagram") return false;
    this.orbit(result, selected.branch, clamp(selected.point + way, 0, count - 1));
    return true;
  }
}

/** Basins and curves of Python beneath the phase plane. @param {Painter} painter @param {ResultEntry[]} results @param {string[]} plane @param {Record<string, number>} values */
export function paintBeneath(painter, results, plane, values) {
  for (const result of results) {
    if (differing(result, values).length) continue;
    if (result.plane && result.plane.join() !== plane.join()) continue;
    if (result.kind === "basins") paintBasins(painter, result);
    if (result.kind === "curves" || result.kind === "basins") {
      for (const { stable, points } of result.curves ?? []) {
        const line = stable ? { color: painter.palette.separatrix, width: 1.2, dash: [5, 3] } : { color: painter.palette.unstable, width: 1, dash: [5, 3] };
        painter.curve(points.map((p) => p[0] ?? NaN), points.map((p) => p[1] ?? NaN), line);
      }
    }
  }
}

/** @param {Painter} painter @param {ResultEntry} result */
function paintBasins(painter, result) {
  const [xs, ys] = [result.x ?? [], result.y ?? []];
  painter.ctx.globalAlpha = 0.35;
  xs.forEach((_, i) => {
    const [left, right] = edges(xs, i);
    ys.forEach((_y, k) => {
      const label = result.cells?.[i]?.[k];
      if (label == null || label < 0) return;
      const [low, high] = edges(ys, k);
      painter.ctx.fillStyle = painter.palette.basins[label % painter.palette.basins.length] ?? "";
      fillCell(painter, left, right, low, high);
    });
  });
  painter.ctx.globalAlpha = 1;
}
