/** The sweep and the basins as they are seen: their settings, their pictures, and what a click on them does. */

import { parameterName, parameterSymbol, symbolOf } from "./symbols.js";
import { inDigits, rangeOf, shortly, typedNumber } from "./numbers.js";
import { axisName } from "./views.js";
import { SWEPT, entriesOf, goesOn } from "./description.js";
import { button } from "./transport.js";

/** @typedef {import("./session.js").Session} Session */
/** @typedef {import("./sweep.js").Sweep} Sweep */
/** @typedef {import("./basins.js").Basins} Basins */
/** @typedef {import("./views.js").View} View */
/** @typedef {import("./types.js").NumberEntry} NumberEntry */

const MOST_JUMPS = 12; // that are listed

/** The settings of a sweep. @param {HTMLElement} host @param {Session} session @param {NumberEntry[]} entries @param {Sweep} sweep */
export function sweepControls(host, session, entries, sweep) {
  const { store } = session;
  const choice = document.createElement("select");
  choice.setAttribute("aria-label", "parameter of the sweep");
  for (const { path, unit } of entries) choice.add(new Option(`${parameterName(path)}${unit && unit !== "1" ? ` (${unit})` : ""}`, path, false, path === store.state.sweep.path));
  choice.addEventListener("change", () => {
    const entry = entries.find(({ path }) => path === choice.value);
    if (entry) store.set({ sweep: { ...store.state.sweep, path: entry.path, low: inDigits(entry.low), high: inDigits(entry.high) } });
  });
  host.append(choice);
  const said = document.createElement("p");
  for (const [name, label] of /** @type {const} */ ([["low", "from"], ["high", "to"], ["count", "values"], ["periods", "periods at each"]])) {
    const allowed = name === "count" || name === "periods" ? SWEPT[name] : null;
    const write = (/** @type {number} */ value) => {
      const refused = allowed && !(value >= allowed[0] && value <= allowed[1]);
      if (refused) return `${label} must lie in [${allowed.join(", ")}], got ${value}`;
      store.set({ sweep: { ...store.state.sweep, [name]: value } });
      return "";
    };
    host.append(setting(label, () => store.state.sweep[name], write, said, store));
  }
  const run = button(host, "run", "Sweep up and down", () => (sweep.result.done ? sweep.start() : sweep.stop()));
  said.className = "said";
  said.setAttribute("role", "status");
  host.append(said);
  return { said, run };
}

/**
 * One number of a laboratory. @param {string} label @param {() => number} read @param {(value: number) => string} write sets it, or says why not
 * @param {HTMLElement} said @param {import("./store.js").Store} store
 */
function setting(label, read, write, said, store) {
  const whole = document.createElement("label");
  whole.className = "setting";
  const input = document.createElement("input");
  input.type = "text";
  input.value = String(read());
  input.addEventListener("change", () => {
    const found = typedNumber(input.value, { name: label });
    said.textContent = "refusal" in found ? found.refusal : write(found.value);
    input.value = String(read());
  });
  store.on(["sweep"], () => (input.value = String(read())));
  whole.append(`${label} `, input);
  return whole;
}

/** What a sweep says of itself. @param {Sweep["result"]} result */
export function sweepSaid(result) {
  if (result.refusal) return `It ended: ${result.refusal}`;
  if (!result.done) return `${result.up.length + result.down.length} values so far.`;
  if (!result.up.length) return "";
  const unsettled = [...result.up, ...result.down].filter(({ steady, amplitude }) => Number.isFinite(amplitude) && !steady).length;
  const beside = unsettled ? ` At ${unsettled} value${unsettled === 1 ? "" : "s"} the motion has not settled.` : "";
  if (!result.jumps.length) return `No jump on the way up or down.${beside}`;
  const digits = 5;
  const parts = result.jumps.slice(0, MOST_JUMPS).map(({ way, from, to }) => `${way} at ${shortly((from.value + to.value) / 2, digits)}`);
  const more = result.jumps.length - parts.length;
  return `Jumps on the way ${parts.join("; ")}${more > 0 ? `; and ${more} more` : ""}.${beside}`;
}

/** The picture of a sweep. @param {Session} session @param {Sweep} sweep @param {(path: string, value: number, state: number[]|null) => void} show @returns {View} */
export function sweepView(session, sweep, show) {
  const all = () => [...sweep.result.up, ...sweep.result.down];
  const path = () => session.store.state.sweep.path;
  return {
    id: "sweep", title: "Sweep up and down",
    instructions: "A click takes the parameter and the motion of the nearest value.",
    axes: () => {
      const symbol = parameterSymbol(path());
      const coordinate = /** @type {any} */ (session.coordinates[session.store.state.coordinate]);
      const entry = entriesOf(session.description).find((each) => each.path === path());
      const unit = entry?.unit && entry.unit !== "1" ? [` (${entry.unit})`] : [];
      const name = [`${parameterName(path())} `, ...(symbol ? [symbol] : []), ...unit];
      return { x: { name }, y: { name: ["max |", symbolOf(coordinate.name), "|", ...axisName("", coordinate.unit).slice(1)], low: 0 } };
    },
    bounds: () => {
      const found = all().filter(({ amplitude }) => Number.isFinite(amplitude));
      const y = rangeOf([found.map(({ amplitude }) => amplitude)]);
      const { low, high } = session.store.state.sweep;
      return y ? [Math.min(low, high), Math.max(low, high), 0, y.high] : null;
    },
    empty: () => "Press “Sweep up and down”: the motion is carried along while the parameter moves.",
    paint: (painter) => {
      const { palette } = painter;
      for (const [points, color, dash] of /** @type {const} */ ([[sweep.result.up, palette.stable, []], [sweep.result.down, palette.ink, [5, 3]]])) {
        painter.curve(points.map(({ value }) => value), points.map(({ amplitude }) => amplitude), { color, width: 1.5, dash: [...dash] });
        painter.dots(points.map(({ value }) => value), points.map(({ amplitude }) => amplitude), color, 1.8);
      }
      sweepLegend(painter);
    },
    over: (painter) => painter.vertical(session.store.state.values[path()] ?? NaN, { color: painter.palette.separatrix, width: 0.8, dash: [2, 3] }),
    act: (x, y, plot) => {
      const [x0, x1, y0, y1] = plot.seen();
      const far = (/** @type {any} */ p) => ((p.value - x) / (x1 - x0)) ** 2 + ((p.amplitude - y) / (y1 - y0)) ** 2;
      const best = all().filter((p) => Number.isFinite(p.amplitude)).sort((a, b) => far(a) - far(b))[0];
      if (best) show(path(), best.value, best.state);
    },
    read: (x) => {
      const near = (/** @type {any[]} */ points) => points.reduce((best, p) => (!best || Math.abs(p.value - x) < Math.abs(best.value - x) ? p : best), null);
      const [up, down] = [near(sweep.result.up), near(sweep.result.down)];
      return up ? `${parameterName(path())} = ${up.value}: up ${up.amplitude}${down ? `, down ${down.amplitude}` : ""}` : null;
    },
    csv: () => ({
      value: all().map(({ value }) => value), amplitude: all().map(({ amplitude }) => amplitude),
      upwards: all().map((_, i) => (i < sweep.result.up.length ? 1 : 0)),
    }),
  };
}

/** @param {import("./plot.js").Painter} painter */
function sweepLegend(painter) {
  const { ctx, palette, box } = painter;
  ctx.font = `12px ${palette.serif}`;
  ctx.textAlign = "left";
  [["up", palette.stable, []], ["down", palette.ink, [5, 3]]].forEach(([name, color, dash], i) => {
    const [x, y] = [box.left + box.width - 70, box.top + 18 + 18 * i];
    painter.pen({ color: /** @type {string} */ (color), width: 1.5, dash: /** @type {number[]} */ (dash) });
    ctx.beginPath();
    ctx.moveTo(x, y - 4);
    ctx.lineTo(x + 24, y - 4);
    ctx.stroke();
    ctx.setLineDash([]);
    ctx.fillStyle = palette.ink;
    ctx.fillText(name, x + 30, y);
  });
}

/** The picture of basins. @param {Session} session @param {Basins} basins @param {(x: number, y: number) => void} startAt @returns {View} */
export function basinsView(session, basins, startAt) {
  const coordinate = () => /** @type {any} */ (session.coordinates[session.store.state.coordinate]);
  /** @type {HTMLCanvasElement|null} */
  let image = null;
  return {
    id: "basins", title: "Basins of attraction", instructions: "A click starts a motion there.",
    axes: () => ({ x: { name: axisName(coordinate().name, coordinate().unit) }, y: { name: axisName(`${coordinate().name}_velocity`, coordinate().unit) } }),
    bounds: () => (basins.labels.length ? /** @type {any} */ (basins.window) : null),
    empty: () => (goesOn(session.description) ? "Press “Compute basins”: every cell is a motion of its own." : "Basins need a load that repeats itself or is constant."),
    paint: (painter) => {
      const [x0, x1, y0, y1] = /** @type {[number, number, number, number]} */ (basins.window);
      image = basins.image(painter.palette.basins, painter.palette.paper);
      painter.ctx.imageSmoothingEnabled = false;
      painter.ctx.drawImage?.(image, painter.x(x0), painter.y(y1), painter.x(x1) - painter.x(x0), painter.y(y0) - painter.y(y1));
      basins.attractors.forEach(({ section }, i) => {
        const k = session.store.state.coordinate;
        const [x, y] = [section[k] ?? NaN, section[k + session.coordinates.length] ?? NaN];
        painter.mark(x, y, painter.palette.ink, 8);
        painter.ctx.font = `11px ${painter.palette.sans}`;
        painter.ctx.fillStyle = painter.palette.paper;
        painter.ctx.textAlign = "center";
        painter.ctx.fillText(String(i + 1), painter.x(x), painter.y(y) + 4);
      });
    },
    act: startAt,
    read: (x, y) => {
      const label = basins.at(x, y);
      const where = `${coordinate().name} = ${shortly(x)}, velocity = ${shortly(y)}`;
      if (label === null) return where;
      return `${where}: ${label === -1 ? "undecided" : label === -2 ? "the motion ends" : `${label + 1}, ${basins.attractors[label]?.name}`}`;
    },
    csv: () => {
      const cells = Array.from(basins.labels.keys());
      const centres = cells.map((cell) => basins.centre(cell));
      return { [coordinate().name]: centres.map(({ x }) => x), velocity: centres.map(({ y }) => y), attractor: Array.from(basins.labels, (l) => l + (l >= 0 ? 1 : 0)) };
    },
  };
}

/** The list of attractors with their colours. @param {HTMLElement} host @param {Basins} basins @param {string[]} colors */
export function basinsLegend(host, basins, colors) {
  host.replaceChildren();
  basins.attractors.forEach(({ name, cells }, i) => {
    const item = document.createElement("li");
    const patch = document.createElement("span");
    patch.className = "patch";
    patch.style.background = colors[i % colors.length] ?? "";
    item.append(patch, `${i + 1}: ${name} (${((100 * cells) / Math.max(basins.counted, 1)).toFixed(1)} %)`);
    host.append(item);
  });
}
