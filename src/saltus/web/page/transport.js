/** Play, pause, step and speed: the time that is shown, and how it moves. */

import { allDigits, clamp } from "./numbers.js";

/** @typedef {import("./session.js").Session} Session */

const SLIDER = 10000; // steps of the slider over time
const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 8, 16]; // units of time per second
const STEPS_PER_PERIOD = 48;

export class Transport {
  /** @param {HTMLElement} host @param {Session} session */
  constructor(host, session) {
    this.session = session;
    this.play = button(host, "play", "Play", () => this.toggle());
    button(host, "first", "To the start", () => this.to(session.motion?.time.first ?? 0)).replaceChildren(icon("M3 3V13M13 3L5 8L13 13Z"));
    button(host, "before", "To the impact before", () => this.toEvent(-1)).replaceChildren(icon("M9 3L3 8L9 13M12 3V9M12 12V13"));
    button(host, "back", "One step back", () => this.step(-1)).replaceChildren(icon("M11 3L5 8L11 13Z"));
    button(host, "ahead", "One step ahead", () => this.step(1)).replaceChildren(icon("M5 3L11 8L5 13Z"));
    button(host, "next", "To the next impact", () => this.toEvent(1)).replaceChildren(icon("M7 3L13 8L7 13M4 3V9M4 12V13"));
    this.slider = document.createElement("input");
    Object.assign(this.slider, { type: "range", min: "0", max: String(SLIDER), step: "1", className: "time" });
    this.slider.setAttribute("aria-label", "time");
    this.slider.addEventListener("input", () => this.dragged());
    this.speed = speedChoice(session);
    this.clock = document.createElement("output");
    this.clock.className = "clock";
    host.append(this.slider, this.speed, this.clock);
    /** @type {number|null} */
    this.last = null;
    session.store.on(["playing"], () => this.playingChanged());
    this.show();
  }

  get state() {
    return this.session.store.state;
  }

  toggle() {
    this.session.store.set({ playing: !this.state.playing });
  }

  playingChanged() {
    this.last = null;
    this.show();
    if (this.state.playing) requestAnimationFrame((now) => this.tick(now));
  }

  /** @param {number} now */
  tick(now) {
    if (!this.state.playing || !this.session.motion) return;
    const { first, last } = this.session.motion.time;
    const passed = this.last === null ? 0 : Math.min((now - this.last) / 1000, 0.1);
    this.last = now;
    const next = this.state.cursor + passed * this.state.speed;
    this.session.store.set({ cursor: next > last ? first : next });
    requestAnimationFrame((later) => this.tick(later));
  }

  /** Show a time, and stand still there. @param {number} time */
  to(time) {
    const motion = this.session.motion;
    if (motion) this.session.store.set({ playing: false, cursor: clamp(time, motion.time.first, motion.time.last) });
  }

  /** @param {number} way */
  step(way) {
    this.to(this.state.cursor + (way * (this.session.period ?? 2 * Math.PI)) / STEPS_PER_PERIOD);
  }

  /** @param {number} way */
  toEvent(way) {
    const events = this.session.motion?.events ?? [];
    const now = this.state.cursor;
    const found = way > 0 ? events.find(({ time }) => time > now + 1e-12) : [...events].reverse().find(({ time }) => time < now - 1e-12);
    if (found) this.to(found.time);
  }

  dragged() {
    const motion = this.session.motion;
    if (!motion) return;
    const { first, last } = motion.time;
    this.to(first + ((last - first) * Number(this.slider.value)) / SLIDER);
  }

  show() {
    const { playing, cursor } = this.state;
    this.play.textContent = playing ? "Pause" : "Play";
    this.play.setAttribute("aria-pressed", String(playing));
    const motion = this.session.motion;
    if (!motion) return;
    const { first, last } = motion.time;
    this.slider.value = String(Math.round((SLIDER * (cursor - first)) / (last - first || 1)));
    const periods = this.session.period ? ` (${(cursor / this.session.period).toFixed(3)} forcing periods)` : "";
    this.clock.textContent = playing ? `τ = ${cursor.toFixed(3)}${periods}` : `τ = ${allDigits(cursor)}${periods}`;
    this.slider.setAttribute("aria-valuetext", `time ${cursor.toFixed(3)}`);
  }
}

/** A small drawing on a button, 16 units wide. @param {string} path */
function icon(path) {
  const space = "http://www.w3.org/2000/svg";
  const picture = document.createElementNS(space, "svg");
  picture.setAttribute("viewBox", "0 0 16 16");
  picture.setAttribute("aria-hidden", "true");
  const line = document.createElementNS(space, "path");
  line.setAttribute("d", path);
  picture.append(line);
  return picture;
}

/** @param {HTMLElement} host @param {string} name @param {string} label @param {() => void} act */
export function button(host, name, label, act) {
  const made = document.createElement("button");
  made.type = "button";
  made.className = name;
  made.textContent = label;
  made.setAttribute("aria-label", label);
  made.title = label;
  made.addEventListener("click", act);
  host.append(made);
  return made;
}

/** @param {Session} session */
function speedChoice(session) {
  const select = document.createElement("select");
  select.setAttribute("aria-label", "speed, units of time per second");
  select.title = "units of time per second";
  const speeds = [...new Set([...SPEEDS, session.store.state.speed])].sort((a, b) => a - b);
  for (const speed of speeds) select.add(new Option(`${speed} τ/s`, String(speed), false, speed === session.store.state.speed));
  select.addEventListener("change", () => session.store.set({ speed: Number(select.value) }));
  return select;
}
