/** Wheel, fingers and keys on a plot: zoom, pan, a cursor that reads out, and acting at a point. */

/** @typedef {import("./plot.js").Plot} Plot */

const CLICK = 5; // pixels that a pointer may move and still click
const STEP = 0.02; // of the window: how far an arrow key moves the cursor

/** @param {Plot} plot */
export function followGestures(plot) {
  const canvas = plot.top;
  canvas.addEventListener("wheel", (event) => onWheel(plot, event), { passive: false });
  canvas.addEventListener("dblclick", () => plot.whole());
  canvas.addEventListener("keydown", (event) => onKey(plot, event));
  canvas.addEventListener("blur", () => leave(plot));
  new Fingers(plot);
}

/** @param {Plot} plot */
function leave(plot) {
  plot.point(null);
  plot.draw(true);
}

/** @param {Plot} plot @param {MouseEvent} event */
function placeOf(plot, event) {
  const box = plot.top.getBoundingClientRect();
  return plot.at(event.clientX - box.left, event.clientY - box.top);
}

/** @param {Plot} plot @param {WheelEvent} event */
function onWheel(plot, event) {
  event.preventDefault();
  const { x, y } = placeOf(plot, event);
  plot.zoom(Math.exp(Math.max(-0.5, Math.min(0.5, event.deltaY * 0.0015))), x, y);
}

/** Fingers or the mouse: one pans or clicks, two zoom. */
class Fingers {
  /** @param {Plot} plot */
  constructor(plot) {
    this.plot = plot;
    /** @type {Map<number, {x: number, y: number}>} */
    this.down = new Map();
    this.moved = 0;
    const canvas = plot.top;
    canvas.addEventListener("pointerdown", (event) => this.start(event));
    canvas.addEventListener("pointermove", (event) => this.move(event));
    canvas.addEventListener("pointerup", (event) => this.end(event, true));
    canvas.addEventListener("pointercancel", (event) => this.end(event, false));
    canvas.addEventListener("pointerleave", () => this.down.size || leave(plot));
  }

  /** @param {PointerEvent} event */
  start(event) {
    if (event.pointerType === "mouse" && event.button !== 0) return;
    this.plot.top.setPointerCapture(event.pointerId);
    if (!this.down.size) this.moved = 0;
    this.down.set(event.pointerId, { x: event.clientX, y: event.clientY });
  }

  /** @param {PointerEvent} event */
  move(event) {
    const { plot } = this;
    const before = this.down.get(event.pointerId);
    if (!before) {
      plot.point(placeOf(plot, event));
      plot.draw(true);
      return;
    }
    const now = { x: event.clientX, y: event.clientY };
    this.moved += Math.hypot(now.x - before.x, now.y - before.y);
    const other = [...this.down].find(([id]) => id !== event.pointerId)?.[1];
    if (other) this.pinch(other, before, now);
    else if (this.moved > CLICK) plot.pan((before.x - now.x) / plot.width, (now.y - before.y) / plot.height);
    this.down.set(event.pointerId, now);
  }

  /** @param {{x: number, y: number}} other @param {{x: number, y: number}} before @param {{x: number, y: number}} now */
  pinch(other, before, now) {
    const box = this.plot.top.getBoundingClientRect();
    const apart = (/** @type {{x: number, y: number}} */ a) => Math.max(Math.hypot(a.x - other.x, a.y - other.y), 1);
    const middle = this.plot.at((now.x + other.x) / 2 - box.left, (now.y + other.y) / 2 - box.top);
    this.plot.zoom(apart(before) / apart(now), middle.x, middle.y);
  }

  /** @param {PointerEvent} event @param {boolean} lifted */
  end(event, lifted) {
    const { plot } = this;
    const last = this.down.size === 1;
    if (!this.down.delete(event.pointerId)) return;
    const point = placeOf(plot, event);
    if (lifted && last && this.moved <= CLICK) {
      plot.options.act?.(point.x, point.y, plot);
      plot.point(event.pointerType === "mouse" ? point : null);
      plot.draw(true);
    }
  }
}

/** Arrows move the cursor, with Shift the window; plus, minus and 0 zoom; Enter acts; Escape takes the cursor away. @param {Plot} plot @param {KeyboardEvent} event */
function onKey(plot, event) {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  if (plot.options.key?.(event.key) || known(plot, event)) event.preventDefault();
}

/** @param {Plot} plot @param {KeyboardEvent} event */
function known(plot, event) {
  const [x0, x1, y0, y1] = plot.seen();
  const { x, y } = plot.cursor ?? { x: (x0 + x1) / 2, y: (y0 + y1) / 2 };
  /** @type {Record<string, [number, number]>} */
  const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
  const way = arrows[event.key];
  if (way && event.shiftKey) plot.pan(way[0] * 0.1, way[1] * 0.1);
  else if (way) plot.point({ x: x + way[0] * STEP * (x1 - x0), y: y + way[1] * STEP * (y1 - y0) });
  else if (event.key === "+" || event.key === "=") plot.zoom(0.8, x, y);
  else if (event.key === "-") plot.zoom(1.25, x, y);
  else if (event.key === "0") plot.whole();
  else if (event.key === "Enter" && plot.cursor) plot.options.act?.(x, y, plot);
  else if (event.key === "Escape" && plot.cursor) plot.point(null);
  else return false;
  plot.draw(true);
  return true;
}
