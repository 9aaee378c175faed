/** The page put together: it opens the engine, makes the controls and the views, and lets them follow one state. */

import { Frame, Store } from "./store.js";
import { MOST_PERIODS, Session, refusalFrom } from "./session.js";
import { Plot } from "./plot.js";
import { Stage } from "./stage.js";
import { Transport, button } from "./transport.js";
import { numberGroup } from "./controls.js";
import { energyView, extremaOf, phasePlane, stroboscopic, timeHistory } from "./views.js";
import { validityNow, validityOfAll } from "./validity.js";
import { stateOf } from "./link.js";
import { Address } from "./address.js";
import { asCsv, asPng, asPython, asSvg, asToml, save } from "./exports.js";
import { Sweep } from "./sweep.js";
import { BASIN_GRID, Basins } from "./basins.js";
import { basinsLegend, basinsView, sweepControls, sweepSaid, sweepView } from "./laboratory.js";
import { Choice, differingSaid, ofThisSystem, orbitSaid, paintBeneath, resultView, specialLegend } from "./results_view.js";
import { currentPalette, forgetPalette } from "./palette.js";
import { entriesOf, firstState, goesOn, isPeriodic, spaced, startEntries, tamed } from "./description.js";
import { Embedding } from "./embedding.js";
import { History } from "./history.js";

/** @typedef {import("./types.js").Description} Description */
/** @typedef {import("./types.js").Engine} Engine */
/** @typedef {import("./types.js").State} State */
/** @typedef {import("./types.js").NumberEntry} NumberEntry */
/** @typedef {import("./views.js").View} View */

const BASIN_PERIODS = 100; // of each motion of a basin at most
const QUIET = 200; // milliseconds after the last change before the margins of the whole motion are followed

/**
 * The page.
 * @typedef {object} Opening
 * @property {Engine} engine @property {Description} description @property {() => import("./basins.js").WorkerLike} makeWorker
 * @property {Uint8Array|null} wasm
 */
export class Page {
  /** @param {Opening} opening */
  constructor({ engine, description, makeWorker, wasm }) {
    this.description = description;
    this.first = firstState(description);
    const linked = stateOf(location.hash.slice(1), this.first, description);
    this.store = new Store("state" in linked ? tamed(linked.state, description) : this.first);
    this.session = new Session(engine, description, this.store);
    this.frame = new Frame();
    /** @type {{plot: Plot, view: View}[]} */
    this.plots = [];
    /** @type {import("./controls.js").NumberField[]} */
    this.fields = [];
    /** @type {ReturnType<typeof setTimeout>|undefined} */
    this.checking = undefined;
    this.address = new Address(this.store, this.first, description, (found) => this.linked(found));
    this.results = description.results ?? [];
    /** Which of the results is shown, or -1. */
    this.shownResult = -1;
    this.session.compute();
    if (this.session.refusal && "state" in linked) {
      this.store.state = this.first;
      this.session.compute();
    }
    this.stage = new Stage(at("stage"), this.session);
    this.stage.measure();
    this.transport = new Transport(at("transport"), this.session);
    this.sweep = new Sweep(this.session, () => this.sweepTold());
    this.basins = new Basins(this.session, makeWorker, { wasm, description }, () => this.basinsTold());
    this.makeHead();
    this.makeControls();
    this.makeViews();
    this.makeLaboratory();
    this.makeResults();
    this.follow();
    this.notice("refusal" in linked ? linked.refusal : "");
    this.drawAll();
    this.drawnAt = performance.now(); // since the page was asked for
    if (description.embedded) new Embedding(this, window.parent);
  }

  makeHead() {
    const { description, store } = this;
    const own = description.title && description.title !== description.model.name ? description.title : "";
    document.title = own || spaced(description.model.name);
    at("title").textContent = document.title;
    at("subtitle").textContent = own ? spaced(description.model.name) : "";
    const theme = /** @type {HTMLSelectElement} */ (at("theme"));
    theme.addEventListener("change", () => store.set({ theme: /** @type {any} */ (theme.value) }));
    at("copy-link").hidden = Boolean(description.embedded); // a page in a notebook has no address
    at("copy-link").addEventListener("click", async () => this.notice(await this.address.copy()));
    at("save-toml").addEventListener("click", () => save("study.toml", asToml(description, store.state)));
    at("save-python").addEventListener("click", () => save("study.py", asPython(description, store.state)));
    this.history = new History(store, (step) => this.replaceState({ ...store.state, ...step, selected: null }), (any) => { undo.disabled = !any; });
    const undo = /** @type {HTMLButtonElement} */ (at("undo"));
    undo.addEventListener("click", () => this.history?.undo());
    at("full-screen").hidden = !document.documentElement.requestFullscreen;
    at("full-screen").addEventListener("click", () => this.toggleFullScreen());
    this.makePresets();
    at("reset-all").addEventListener("click", () => this.replaceState({ ...this.first, theme: store.state.theme, degrees: store.state.degrees }));
    this.applyTheme();
  }

  /** What the author of the page proposes to try. */
  makePresets() {
    const presets = this.description.presets ?? [];
    const choice = /** @type {HTMLSelectElement} */ (at("preset"));
    at("preset-row").hidden = !presets.length;
    choice.add(new Option("as it was", ""));
    presets.forEach(({ name }, i) => choice.add(new Option(name, String(i))));
    choice.addEventListener("change", () => {
      const { values, start } = presets[Number(choice.value)] ?? { values: {}, start: {} };
      const { theme, degrees } = this.store.state;
      this.replaceState({ ...this.first, theme, degrees, values: { ...this.first.values, ...values }, start: { ...this.first.start, ...start } });
    });
  }

  async toggleFullScreen() {
    try {
      await (document.fullscreenElement ? document.exitFullscreen() : document.documentElement.requestFullscreen());
    } catch {
      this.notice("The browser does not let this page fill the screen.");
    }
  }

  makeControls() {
    const { description, store } = this;
    const panel = at("numbers");
    const host = {
      value: (/** @type {string} */ path) => this.numberAt(path), change: (/** @type {string} */ path, /** @type {number} */ value) => this.change(path, value),
      degrees: () => store.state.degrees, range: (/** @type {string} */ path) => store.state.ranges[path] ?? null,
      setRange: (/** @type {string} */ path, /** @type {[number, number]} */ range) => store.set({ ranges: { ...store.state.ranges, [path]: range } }),
    };
    const group = (/** @type {string} */ title, /** @type {NumberEntry[]} */ entries) => this.fields.push(...numberGroup(panel, title, entries, host));
    group("Model", description.model.parameters);
    group(description.impact?.name ? `Impact law: ${spaced(description.impact.name)}` : "Impact law", description.impact?.parameters ?? []);
    group("Load", description.load.flatMap(({ parameters }) => parameters));
    const starting = startEntries(description, this.first, isPeriodic(description));
    group("Start", starting);
    const idle = description.without_effect ?? [];
    at("without-effect").hidden = !idle.length;
    at("without-effect").textContent = `Without effect on this model: ${idle.join(", ")}.`;
    const degrees = /** @type {HTMLInputElement} */ (at("degrees"));
    degrees.checked = store.state.degrees;
    degrees.addEventListener("change", () => store.set({ degrees: degrees.checked }));
    at("motion-in-radians").hidden = !description.model.coordinates.some(({ unit }) => unit === "rad");
    at("degrees-row").hidden = !entriesOf(description).some(({ angle }) => angle);
  }

  /** @param {string} path */
  numberAt(path) {
    const { state } = this.store;
    if (path === "start.periods" || path === "start.duration") return state.periods;
    return path.startsWith("start.") ? (state.start[path.slice(6)] ?? 0) : (state.values[path] ?? NaN);
  }

  /** Change a number if the engine takes it. @param {string} path @param {number} value @returns {{message: string}|null} */
  change(path, value) {
    const { state } = this.store;
    if (!Number.isFinite(value)) return { message: `${path} must be finite, got ${value}` };
    if (path === "start.periods" || path === "start.duration") {
      if (!(value > 0 && value <= MOST_PERIODS)) return { message: `${path.slice(6)} must lie in (0, ${MOST_PERIODS}] on this page, got ${value}` };
      this.store.set({ periods: value });
      return null;
    }
    if (path.startsWith("start.")) {
      /** @type {Record<string, number>} */
      const start = { ...state.start, [path.slice(6)]: value };
      const refused = this.tried(state.values, start);
      if (!refused) this.store.set({ start, selected: null, ...(path === "start.time" ? { cursor: value } : {}) });
      return refused;
    }
    const values = { ...state.values, [path]: value };
    const refused = this.session.refusalOf(values);
    if (!refused) this.store.set({ values, selected: null });
    return refused;
  }

  /** Whether a motion can start: null, or the sentence. @param {Record<string, number>} values @param {Record<string, number>} start */
  tried(values, start) {
    const refused = this.session.refusalOf(values);
    if (refused) return refused;
    try {
      const system = this.session.engine.system(values);
      this.session.engine.simulate(system, start, 1e-6);
      return null;
    } catch (error) {
      return refusalFrom(error);
    }
  }

  /** Start a motion at a point of the phase plane that is shown. @param {number} x @param {number} y */
  startAt(x, y) {
    const { state } = this.store;
    const chosen = /** @type {any} */ (this.description.model.coordinates[state.coordinate]);
    /** @type {Record<string, number>} */
    const start = { ...state.start, [chosen.name]: x, [chosen.velocity]: y };
    const refused = this.tried(state.values, start);
    this.notice(refused?.message ?? "");
    if (!refused) this.store.set({ start, cursor: start.time ?? 0, selected: null });
  }

  makeViews() {
    const { session } = this;
    const show = (/** @type {number} */ time) => this.transport.to(time);
    const beneath = (/** @type {any} */ painter) => {
      const chosen = /** @type {any} */ (session.coordinates[this.store.state.coordinate]);
      paintBeneath(painter, this.results, [chosen.name, chosen.velocity], this.store.state.values);
    };
    this.addPlot(phasePlane(session, (x, y) => this.startAt(x, y), beneath));
    this.addPlot(timeHistory(session, show));
    this.addPlot(stroboscopic(session, show));
    this.addPlot(energyView(session, show));
    const choice = /** @type {HTMLSelectElement} */ (at("coordinate"));
    session.coordinates.forEach(({ name }, i) => choice.add(new Option(name.replace(/_/g, " "), String(i))));
    choice.value = String(this.store.state.coordinate);
    choice.addEventListener("change", () => this.store.set({ coordinate: Number(choice.value), windows: {} }));
    at("coordinate-row").hidden = session.coordinates.length < 2;
  }

  /** @param {View} view */
  addPlot(view) {
    const host = at(`view-${view.id}`);
    const plot = new Plot(host, {
      ...view, window: () => /** @type {any} */ (this.store.state.windows[view.id] ?? null),
      zoomed: (window_) => this.store.set({ windows: { ...this.store.state.windows, [view.id]: window_ } }),
    });
    const keys = "Arrow keys move the cursor, with Shift the window; plus, minus and 0 zoom.";
    plot.top.setAttribute("aria-description", `${view.instructions ?? ""} ${keys}`);
    plot.top.title = view.instructions ?? "";
    this.plots.push({ plot, view });
    const menu = host.closest("figure")?.querySelector(".save");
    if (!(menu instanceof HTMLElement)) return;
    button(menu, "png", "PNG", async () => save(`${view.id}.png`, await asPng(plot)));
    button(menu, "svg", "SVG", () => save(`${view.id}.svg`, asSvg(plot), "image/svg+xml"));
    button(menu, "csv", "CSV", () => save(`${view.id}.csv`, asCsv(view.csv()), "text/csv"));
    for (const each of menu.querySelectorAll("button")) each.setAttribute("aria-label", `${view.title} as ${each.textContent}`);
  }

  makeLaboratory() {
    const { session } = this;
    const entries = entriesOf(this.description);
    const controls = sweepControls(at("sweep-controls"), session, entries, this.sweep);
    this.sweepSaid = controls.said;
    this.sweepRun = controls.run;
    this.addPlot(sweepView(session, this.sweep, (path, value, state) => this.showMotion({ [path]: value }, state && this.choice?.startFrom(state, 0), null)));
    this.addPlot(basinsView(session, this.basins, (x, y) => this.startAt(x, y)));
    at("basins-run").addEventListener("click", () => this.toggleBasins());
  }

  toggleBasins() {
    if (!this.basins.done) {
      this.basins.stop();
      this.basinsTold();
    } else if (goesOn(this.description)) this.basins.start(this.planeWindow(), BASIN_PERIODS);
  }

  /** The window of the phase plane, over which basins are computed. */
  planeWindow() {
    return this.plotOf("phase")?.seen() ?? [-1, 1, -1, 1];
  }

  /** @param {string} id */
  plotOf(id) {
    return this.plots.find(({ view }) => view.id === id)?.plot;
  }

  sweepTold() {
    const { result } = this.sweep;
    opened("view-sweep", !result.done || result.up.length > 0);
    if (this.sweepSaid) this.sweepSaid.textContent = sweepSaid(result);
    if (this.sweepRun) this.sweepRun.textContent = result.done ? "Sweep up and down" : "Stop";
    this.frame.before("sweep", () => this.plotOf("sweep")?.draw());
  }

  basinsTold() {
    const { basins } = this;
    opened("view-basins", basins.labels.length > 0);
    const cells = BASIN_GRID * BASIN_GRID;
    at("basins-run").textContent = basins.done ? "Compute basins" : "Stop";
    const share = `${((100 * basins.counted) / cells).toFixed(0)} % of ${BASIN_GRID} × ${BASIN_GRID} cells`;
    const { undecided, ended } = basins.open();
    const rest = undecided || ended ? `; ${undecided} undecided after ${BASIN_PERIODS} periods, ${ended} ended` : "";
    at("basins-said").textContent = basins.refusal || (basins.labels.length ? share + rest : "");
    this.frame.before("basins", () => {
      basinsLegend(at("basins-legend"), basins, currentPalette().basins);
      this.plotOf("basins")?.draw();
    });
  }

  makeResults() {
    const { store } = this;
    this.shownResult = store.state.selected?.result ?? -1;
    this.choice = new Choice(this.session, (numbers, start, periods) => this.showMotion(numbers, start, periods), () => this.shownResult);
    const choice = /** @type {HTMLSelectElement} */ (at("result-choice"));
    choice.addEventListener("change", () => {
      this.shownResult = Number(choice.value);
      store.set({ selected: null, windows: { ...store.state.windows, result: null } });
      this.saySelected();
      this.drawAll();
    });
    this.addPlot(resultView(this.session, () => this.results[this.shownResult] ?? null, this.choice));
    this.laidOver(this.results);
  }

  /** Lay results over the page in the place of those that it has; the one that is shown stays, if it is still there. @param {import("./types.js").ResultEntry[]} results */
  laidOver(results) {
    const { own, refused } = ofThisSystem(results, this.description.digest);
    const { selected } = this.store.state;
    if (selected && orbitOf(own, selected) !== orbitOf(this.results, selected)) this.store.set({ selected: null });
    const before = this.results[this.shownResult]?.title;
    this.results = own;
    const plotted = own.flatMap((result, i) => (isPlotted(result) ? [i] : []));
    const there = plotted.filter((i) => own[i]?.title === before);
    this.shownResult = there.includes(this.shownResult) ? this.shownResult : (there[0] ?? plotted[0] ?? -1);
    at("results").hidden = !(plotted.length || refused.length);
    at("results-refused").textContent = refused.join(" ");
    const choice = /** @type {HTMLSelectElement} */ (at("result-choice"));
    choice.replaceChildren(...plotted.map((i) => new Option(own[i]?.title, String(i))));
    choice.hidden = plotted.length < 2;
    choice.value = String(this.shownResult);
    this.saySelected();
    this.frame.before("views", () => this.drawAll());
  }

  saySelected() {
    const { selected } = this.store.state;
    const result = selected && this.results[selected.result];
    const shown = this.results[this.shownResult];
    specialLegend(at("special-legend"), shown);
    at("differing").textContent = shown ? differingSaid(shown, this.store.state.values) : "";
    at("orbit").textContent = selected && result ? orbitSaid(result, selected.branch, selected.point) : "";
  }

  /** Take numbers and a start from a result or a sweep. @param {Record<string, number>} numbers @param {Record<string, number>|null|undefined} start @param {number|null} periods */
  showMotion(numbers, start, periods) {
    const { state } = this.store;
    const values = { ...state.values, ...numbers };
    const begun = start ?? state.start;
    const refused = this.tried(values, begun);
    this.notice(refused?.message ?? "");
    if (!refused) this.store.set({ values, start: begun, cursor: begun.time ?? 0, periods: periods ?? state.periods });
  }

  /** Let everything follow the state. */
  follow() {
    const { store, frame } = this;
    store.on(["values", "start", "periods"], () => frame.before("motion", () => this.motionChanged()));
    store.on(["cursor"], () => frame.before("cursor", () => this.cursorChanged()));
    store.on(["hover"], () => frame.before("hover", () => this.drawOver()));
    store.on(["windows", "coordinate"], () => frame.before("views", () => this.drawAll()));
    store.on(["degrees", "ranges"], () => this.showFields());
    store.on(["selected"], () => this.saySelected());
    store.on(["theme"], () => this.applyTheme());
    store.on(["values", "start", "periods", "cursor", "windows", "coordinate", "degrees", "ranges", "selected", "theme", "sweep", "speed"], () => this.address.later());
    addEventListener("resize", () => frame.before("views", () => this.drawAll()));
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.applyTheme());
    document.addEventListener("keydown", (event) => this.key(event));
  }

  motionChanged() {
    this.session.compute();
    this.stage.measure();
    const motion = this.session.motion;
    if (motion) {
      const { cursor } = this.store.state;
      const inside = Math.min(Math.max(cursor, motion.time.first), motion.time.last);
      if (inside !== cursor) this.store.set({ cursor: inside });
    }
    this.showFields();
    this.saySelected();
    this.drawAll();
  }

  showFields() {
    for (const field of this.fields) if (document.activeElement !== field.text || !field.element.classList.contains("refused")) field.show();
  }

  cursorChanged() {
    this.transport.show();
    this.stage.draw();
    this.drawOver();
    this.sayValidity();
  }

  drawOver() {
    for (const { plot } of this.plots) plot.draw(true);
  }

  drawAll() {
    const energy = at("view-energy").closest("figure");
    const { motion } = this.session;
    if (energy) energy.hidden = motion !== null && (motion.energy?.(motion.time.first) ?? null) === null; // not every model has one
    const [periodic, lasting] = [isPeriodic(this.description), goesOn(this.description)];
    hideFigure("view-section", !periodic); // without a period there is no section
    at("view-history").closest("figure")?.classList.toggle("wide", !periodic); // it has the place of both then
    hideFigure("view-sweep", !lasting); // after a pulse nothing settles that a sweep could carry on
    hideFigure("view-basins", !lasting);
    this.stage.draw();
    for (const { plot } of this.plots) plot.draw();
    this.transport.show();
    this.sayValidity();
    this.sayAll();
  }

  /** What is said of the whole motion; its margins are followed once the reader is quiet, as that takes longer than a picture. */
  sayAll() {
    const { motion } = this.session;
    at("summary").textContent = validityOfAll(this.session);
    at("extrema").textContent = extremaOf(this.session);
    clearTimeout(this.checking);
    if (motion?.checked !== null) return;
    this.checking = setTimeout(() => motion === this.session.motion && motion.validity && this.sayAll(), QUIET);
  }

  sayValidity() {
    const now = validityNow(this.session, this.store.state.cursor);
    const said = at("validity");
    const text = [this.stage.note, now.text].filter(Boolean).join(" ");
    if (said.textContent !== text) said.textContent = text;
    said.dataset.kind = now.kind;
    const flash = this.stage.flashAt(this.store.state.cursor);
    at("impact").textContent = flash ? "impact" : "";
  }

  applyTheme() {
    const { theme } = this.store.state;
    forgetPalette();
    /** @type {HTMLSelectElement} */ (at("theme")).value = theme;
    if (theme === "system") delete document.documentElement.dataset.theme;
    else document.documentElement.dataset.theme = theme;
    this.frame.before("views", () => this.drawAll());
  }

  /** A link was opened on the page. @param {{state: State}|{refusal: string}} found */
  linked(found) {
    if ("refusal" in found) this.notice(found.refusal);
    else this.replaceState(tamed(found.state, this.description));
  }

  /** @param {State} state */
  replaceState(state) {
    const refused = this.tried(state.values, state.start);
    this.notice(refused?.message ?? "");
    if (!refused) this.store.set({ ...state, playing: false, hover: null });
  }

  /** @param {string} text */
  notice(text) {
    at("notice").textContent = text;
    at("notice").hidden = !text;
  }

  /** Space plays; comma and full stop step; n and p go to impacts. @param {KeyboardEvent} event */
  key(event) {
    const target = /** @type {HTMLElement} */ (event.target);
    if ((event.ctrlKey || event.metaKey) && event.key === "z" && target.tagName !== "INPUT") return this.history?.undo();
    if (event.ctrlKey || event.metaKey || event.altKey || /^(INPUT|SELECT|TEXTAREA|SUMMARY|A)$/.test(target.tagName)) return;
    if (target.tagName === "BUTTON" && event.key === " ") return;
    const { transport } = this;
    const act = { " ": () => transport.toggle(), ",": () => transport.step(-1), ".": () => transport.step(1), n: () => transport.toEvent(1), p: () => transport.toEvent(-1) }[event.key];
    if (!act) return;
    event.preventDefault();
    act();
  }
}

/** An orbit of a result as text, by which it is told from another at its place. @param {import("./types.js").ResultEntry[]} results @param {{result: number, branch: number, point: number}} chosen */
function orbitOf(results, { result, branch, point }) {
  const shown = results[result];
  return shown ? `${shown.title}: ${orbitSaid(shown, branch, point)}` : "";
}

/** Whether a result has a view of its own; the others lie beneath the phase plane. @param {{kind: string}} result */
function isPlotted({ kind }) {
  return kind === "diagram" || kind === "chart";
}

/** Show the view of a figure that waits to be asked for. @param {string} id @param {boolean} asked */
function opened(id, asked) {
  at(id).closest("figure")?.classList.toggle("unopened", !asked);
}

/** Hide a figure that can have no content. @param {string} id @param {boolean} hidden */
function hideFigure(id, hidden) {
  const figure = at(id).closest("figure");
  if (figure) figure.hidden = hidden;
}

/** @param {string} id */
function at(id) {
  const found = document.getElementById(id);
  if (!found) throw new Error(`the page has no element ${id}`);
  return found;
}
