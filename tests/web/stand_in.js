/**
 * A plain integrator behind the interface of `engine.js`, for tests of the page alone: Runge-Kutta steps of one contact and
 * cubic interpolation. It is no engine: it is exact to about 1e-5, and knows three models.
 */

const STEPS = 100; // in a unit of time divided by ten

const MODELS = {
  WallOscillator: {
    wall: (v) => ({ at: v["model.wall"], bounce: true }),
    acceleration: (v, t, x, w, side, load) => load("force", t) - v["model.damping"] * w - v["model.stiffness"] * x,
  },
  Metainterface: {
    wall: () => ({ at: 0, bounce: false }),
    acceleration: (v, t, x, w, side, load) =>
      Math.sin(side * x + v["model.beta0"]) * load("horizontal", t) +
      side * Math.cos(side * x + v["model.beta0"]) * load("vertical", t) - v["model.damping"] * w - x,
  },
};

/** @param {any} description */
export function standIn(description) {
  const model = MODELS[description.model.name];
  const entries = [...description.model.parameters, ...(description.impact?.parameters ?? []), ...description.load.flatMap((l) => l.parameters)];
  return {
    system(values) {
      for (const { path, angle } of entries) {
        const value = values[path];
        if (!Number.isFinite(value)) throw refusal(path, `${path} must be finite, got ${value}`);
        if (/damping|stiffness$|frequency/.test(path) && value < 0) throw refusal(path, `${path.split(".").pop()} must lie in [0, inf), got ${value}`);
        if (angle && path.startsWith("model.") && !(value > 0 && value < Math.PI)) throw refusal(path, `${path.split(".").pop()} must lie in (0, pi) rad, got ${value}`);
      }
      const rate = values["load.frequency"];
      return { period: rate ? (2 * Math.PI) / rate : null, values };
    },
    simulate: (system, start, duration) => simulate(model, description, system, start, duration),
  };
}

function refusal(where, message) {
  return Object.assign(new Error(message), { where });
}

function loadOf(description, values) {
  return (channel, t) => {
    let total = 0;
    for (const entry of description.load.filter((each) => each.channel === channel)) {
      const n = Object.fromEntries(entry.parameters.map((p) => [p.path.split(".").pop(), values[p.path]]));
      total += entry.kind === "Constant" ? values[entry.parameters[0].path] : (n.mean ?? 0) + n.amplitude * Math.sin(values["load.frequency"] * t + (n.phase ?? 0));
    }
    return total;
  };
}

function simulate(model, description, system, start, duration) {
  const { values } = system;
  const { name, velocity } = description.model.coordinates[0];
  const load = loadOf(description, values);
  const wall = model.wall(values);
  let [t, x, w] = [start.time ?? 0, start[name], start[velocity] ?? 0];
  const first = t;
  let side = wall.bounce ? 1 : Math.sign(x - wall.at) || Math.sign(w) || 1;
  const f = (tt, xx, ww) => model.acceleration(values, tt, xx, ww, side, load);
  const steps = [];
  const events = [];
  const h = Math.min(10 / STEPS, (system.period ?? 6) / 80);
  let stop = wall.bounce && x > wall.at ? "outside" : "horizon";
  const gap = (xx) => (wall.bounce ? wall.at - xx : side * (xx - wall.at));
  while (stop === "horizon" && t < first + duration - 1e-12 && steps.length < 400000) {
    const step = Math.min(h, first + duration - t);
    let [nx, nw] = kutta(f, t, x, w, step);
    let taken = step;
    if (gap(nx) < 0) {
      let [low, high] = [0, step];
      for (let i = 0; i < 50; i++) {
        const middle = (low + high) / 2;
        if (gap(kutta(f, t, x, w, middle)[0]) < 0) high = middle;
        else low = middle;
      }
      taken = low;
      [nx, nw] = kutta(f, t, x, w, taken);
      steps.push({ t, taken, x, w, nx, nw, side });
      const after = (wall.bounce ? -1 : 1) * (values["impact.e"] ?? 1) * nw;
      events.push({ time: t + taken, kind: "impact", contact: side, before: [nw], after: [after] });
      if (!wall.bounce) side = -side;
      [t, x, w] = [t + taken, wall.at, after];
      if (Math.abs(after) < 1e-6) stop = "rest";
      continue;
    }
    steps.push({ t, taken, x, w, nx, nw, side });
    [t, x, w] = [t + taken, nx, nw];
  }
  return new StandInMotion(steps, events, { first, last: Math.max(t, first) }, stop, [x, w], { name, velocity });
}

function kutta(f, t, x, w, h) {
  const a1 = f(t, x, w);
  const a2 = f(t + h / 2, x + (h / 2) * w, w + (h / 2) * a1);
  const a3 = f(t + h / 2, x + (h / 2) * w + (h * h * a1) / 4, w + (h / 2) * a2);
  const a4 = f(t + h, x + h * w + (h * h * a2) / 2, w + h * a3);
  return [x + h * w + ((h * h) / 6) * (a1 + a2 + a3), w + (h / 6) * (a1 + 2 * a2 + 2 * a3 + a4)];
}

class StandInMotion {
  constructor(steps, events, time, stop, last, names) {
    Object.assign(this, { steps, events, time, stop, last, names });
    this.starts = Float64Array.from(steps, (step) => step.t);
  }

  state(t) {
    if (!this.steps.length || t >= this.time.last) return this.last;
    let [low, high] = [0, this.steps.length - 1];
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.starts[middle] <= t) low = middle;
      else high = middle - 1;
    }
    const { t: at, taken, x, w, nx, nw } = this.steps[low];
    const s = taken ? Math.min(Math.max((t - at) / taken, 0), 1) : 0;
    const position = (1 + 2 * s) * (1 - s) ** 2 * x + s * (1 - s) ** 2 * taken * w + s * s * (3 - 2 * s) * nx + s * s * (s - 1) * taken * nw;
    return [position, w + s * (nw - w)];
  }

  sample(times) {
    const out = { time: times, [this.names.name]: new Float64Array(times.length), [this.names.velocity]: new Float64Array(times.length) };
    times.forEach((t, i) => ([out[this.names.name][i], out[this.names.velocity][i]] = this.state(t)));
    return out;
  }

  energy(t) {
    return this.state(t)[1] ** 2 / 2;
  }
}
