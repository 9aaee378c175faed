// What the page's modules compute, without a browser: `node --test`.
import assert from "node:assert/strict";
import { test } from "node:test";
import { allDigits, degreesOf, radians, roundStep, tickLabel, ticks, typedNumber } from "../../src/saltus/web/page/numbers.js";
import { asText, symbolOf } from "../../src/saltus/web/page/symbols.js";
import { linkOf, stateOf } from "../../src/saltus/web/page/link.js";
import { firstState, goesOn, prepared, startEntries, tamed } from "../../src/saltus/web/page/description.js";
import { cellPoints } from "../../src/saltus/web/page/cell_drawing.js";
import { amplitudeOf } from "../../src/saltus/web/page/settling.js";
import { changesOf, halve } from "../../src/saltus/web/page/sweep.js";
import { runs, shade } from "../../src/saltus/web/page/results_view.js";
import { wideEnough } from "../../src/saltus/web/page/plot.js";

/** Random numbers in [0, 1) from a seed (mulberry32). */
function random(seed) {
  return () => {
    seed = (seed + 0x6d2b79f5) | 0;
    let t = Math.imul(seed ^ (seed >>> 15), 1 | seed);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
  };
}

const entry = (path, value) => ({ path, value, unit: "1", low: 0, high: 2 });
const description = prepared({
  version: 1, digest: "abc", numbers: [entry("model.damping", 0.1), entry("impact.e", 1), entry("load.force.amplitude", 0.5), entry("load.frequency", 1)],
  model: { name: "WallOscillator", coordinates: [{ name: "x", velocity: "x_velocity", unit: "1" }], parameters: ["model.damping"], margins: { far: "limit" } },
  impact: { name: "NewtonImpact", parameters: ["impact.e"] }, load: [{ channel: "force", kind: "Harmonic", parameters: ["load.force.amplitude"] }],
  start: { time: 0, x: 0, x_velocity: 0 }, study: { system: {}, simulate: { periods: 20 } },
});

test("ticks are round, lie inside, and are written with the decimals of their step", () => {
  const next = random(1);
  for (let i = 0; i < 2000; i++) {
    const low = (next() - 0.5) * 10 ** (12 * next() - 6);
    const high = low + Math.max(Math.abs(low) * 1e-6, 1e-9) + next() * 10 ** (8 * next() - 4);
    const { step, values } = ticks(low, high, 6);
    assert.ok(values.length >= 2 && values.length <= 9, `${low} ${high} ${values}`);
    assert.ok(["1", "2", "5"].includes(step.toExponential(0)[0]));
    for (const value of values) assert.ok(value >= low - step * 1e-6 && value <= high + step * 1e-6);
    assert.equal(new Set(values.map((value) => tickLabel(value, step))).size, values.length);
  }
  assert.equal(roundStep(0.3), 0.5);
  assert.equal(tickLabel(-1.5, 0.5), "−1.5");
});

test("an axis has two ticks however narrow it is, of which neither is outside", () => {
  const next = random(4);
  for (let i = 0; i < 5000; i++) {
    const middle = i % 2 ? 0 : (next() - 0.5) * 10 ** (6 * next() - 3);
    const half = 10 ** (6 * next() - 4) + Math.abs(middle) * 1e-6;
    for (const count of [1, 2, 3]) {
      const { step, values } = ticks(middle - half, middle + half, count);
      assert.ok(values.length >= 2 && values.length <= 5, `${middle} ${half} ${count} ${values}`);
      assert.ok(["1", "2", "5"].includes(step.toExponential(0)[0]));
      for (const value of values) assert.ok(Math.abs(value - middle) <= half * (1 + 1e-6));
    }
  }
  assert.deepEqual(ticks(-1.9, 1.9, 3).values, [-1, 0, 1]); // where a step of 2 is the least above 3.8 / 3
  assert.deepEqual(ticks(0, 10, 5).values, [0, 2, 4, 6, 8, 10]);
});

test("what is typed is a number with its unit, or is refused with a sentence", () => {
  const damping = { name: "damping" };
  const beta0 = { name: "beta0", angle: true, degrees: true };
  assert.deepEqual(typedNumber(" −1.5e-3 ", damping), { value: -0.0015 });
  assert.deepEqual(typedNumber("80 deg", { ...beta0, degrees: false }), { value: radians(80) });
  assert.deepEqual(typedNumber("80", beta0), { value: radians(80) });
  assert.deepEqual(typedNumber("1.4 rad", beta0), { value: 1.4 });
  for (const text of ["", "abc", "1,5", "1e999", "NaN", "Infinity", "0x10", "1 deg", "1..2", "<b>1</b>"]) {
    assert.match(typedNumber(text, damping).refusal, /^damping must be/, text);
  }
});

test("an angle in degrees goes back to the same radians", () => {
  const next = random(2);
  for (let i = 0; i < 2000; i++) {
    const degrees = Number(((next() - 0.5) * 360).toFixed(Math.floor(next() * 6)));
    assert.equal(degreesOf(radians(degrees)), degrees);
  }
  assert.equal(allDigits(-0.1), "−0.1");
});

test("names are set as symbols", () => {
  assert.equal(asText(symbolOf("theta_1")), "θ₁");
  assert.equal(asText(symbolOf("beta0")), "β₀");
  assert.equal(asText(symbolOf("x_velocity")), "x\u0307");
  assert.equal(asText(symbolOf("<img src=x>")), "<img src=x>");
});

test("sliders of a start reach as far as the system moves, or 2 where no such distance is given", () => {
  const ends = (coordinate, start) => {
    const described = prepared({ ...description, start: { time: 0, ...start }, model: { ...description.model, coordinates: [coordinate] } });
    return startEntries(described, firstState(described), true).slice(0, 2).map(({ low, high }) => [low, high]);
  };
  const x = { name: "x", velocity: "x_velocity", unit: "1" };
  assert.deepEqual(ends(x, { x: 0, x_velocity: 3 }), [[-2, 2], [-6, 6]]);
  assert.deepEqual(ends({ ...x, reach: [0.002, 0.5] }, { x: 0.005, x_velocity: 0 }), [[-0.01, 0.01], [-0.5, 0.5]]);
});

test("a link holds the whole state", () => {
  const first = firstState(description);
  assert.equal(linkOf(first, first, description), "");
  const state = {
    ...first, values: { ...first.values, "model.damping": 0.1 + 0.2, "load.frequency": 1e-7 }, start: { ...first.start, x: -1 / 3 }, periods: 33,
    cursor: 12.345678901234567, speed: 8, degrees: !first.degrees, theme: "dark", windows: { phase: [-1, 1, -0.1, 2e-9] },
    ranges: { "model.damping": [0, 5] }, sweep: { path: "impact.e", low: 0.1, high: 0.9, count: 11, periods: 5 }, selected: { result: 0, branch: 2, point: 17 },
  };
  assert.deepEqual(stateOf(linkOf(state, first, description), first, description), { state });
  const other = stateOf(linkOf(state, first, description), first, { ...description, digest: "another" });
  assert.match(other.refusal, /another page/);
});

test("of 10 000 damaged links none is shown as if it were right", () => {
  const first = firstState(description);
  const state = { ...first, values: { ...first.values, "model.damping": 0.25 }, start: { ...first.start, x: 0.5 }, windows: { phase: [-1, 1, -1, 1] } };
  const link = linkOf(state, first, description);
  const next = random(3);
  const letters = "0123456789abcdef.&=_-%é#< eNaN";
  for (let i = 0; i < 10000; i++) {
    const at = Math.floor(next() * link.length);
    const letter = letters[Math.floor(next() * letters.length)];
    const kind = i % 4;
    let damaged = link.slice(0, at) + letter + link.slice(at + 1);
    if (kind === 1) damaged = link.slice(0, at);
    if (kind === 2) damaged = link.slice(0, at) + letter + link.slice(at);
    if (kind === 3) damaged = link.slice(0, at) + link.slice(at + 1 + Math.floor(next() * 5));
    const found = stateOf(damaged, first, description);
    if (damaged === link) assert.deepEqual(found, { state });
    else if (damaged === "") assert.deepEqual(found, { state: first });
    else assert.ok("refusal" in found, damaged);
  }
});

test("a link with a right check sum and senseless contents is refused", async () => {
  const { checkSum } = await import("../../src/saltus/web/page/link.js");
  const first = firstState(description);
  const senseless = ["model.damping=NaN", "model.damping=Infinity", "model.damping=1e999", "model.nothing=1", "__proto__=1", "window.phase=1_0_0_1",
    "window.phase=0_1", "show.coordinate=-1", "show.theme=red", "show.selected=1_2_x", "sweep.path=model.nothing", "start.y=1", "range.model.damping=2_1", "="];
  for (const text of senseless) {
    assert.ok("refusal" in stateOf(`${text}&check=${checkSum(text, "abc")}`, first, description), text);
  }
});

test("bars of a cell keep their length, and the halves of a diagonal theirs", () => {
  const distance = ([a, b], [c, d]) => Math.hypot(a - c, b - d);
  for (const [beta0, theta1, theta2] of [[1.4, 0, 0], [1.4, 0.7, 0], [1.2, 0, -1.1], [1.0, 2.0, -0.4]]) {
    const p = cellPoints(beta0, theta1, theta2);
    const half = distance(p.lowerLeft, cellPoints(beta0, 0, 0).slider1[0]);
    for (const [a, b] of [[p.lowerLeft, p.middleLeft], [p.lowerRight, p.middleRight], [p.middleLeft, p.upperLeft], [p.middleRight, p.upperRight]]) {
      assert.ok(Math.abs(distance(a, b) - 1) < 1e-12);
    }
    for (const [a, b] of [[p.lowerLeft, p.slider1[0]], [p.slider1[1], p.middleRight], [p.middleRight, p.slider2[0]], [p.slider2[1], p.upperLeft]]) {
      assert.ok(Math.abs(distance(a, b) - half) < 1e-12);
    }
  }
});

/** The jumps that a sweep finds among points of a curve, with the motions between them from the curve itself. */
function jumpsAlong(values, amplitude, steady = () => true) {
  const point = (value) => ({ value, amplitude: amplitude(value), state: [], stop: "horizon", steady: steady(value) });
  const points = values.map(point);
  const least = 0.02 * Math.max(...points.map((p) => p.amplitude));
  return changesOf(points, least).filter((step) => {
    for (let k = 0; k < 8 && step.change > least; k++) halve(step, point((step.from.value + step.to.value) / 2));
    return step.change > least;
  });
}

test("a jump is what stays in ever smaller steps, and no flank of a resonance is one", () => {
  const values = Array.from({ length: 41 }, (_, i) => 0.4 + i / 40);
  const resonance = (w) => 1 / Math.hypot(1 - w * w, 0.05 * w);
  assert.equal(jumpsAlong(values, resonance).length, 0);
  const broken = (w) => (w < 0.8137 ? 1 : 0.4) * resonance(w);
  const [jump, ...others] = jumpsAlong(values, broken);
  assert.equal(others.length, 0);
  assert.ok(jump.from.value < 0.8137 && 0.8137 < jump.to.value && jump.to.value - jump.from.value < 1.01e-4);
  const rough = (w) => 1 + Math.sin(1e5 * w);
  assert.equal(jumpsAlong(values, rough, () => false).length, 0); // it never settles
});

test("a branch is drawn in stretches of one stability, which meet", () => {
  assert.deepEqual(runs([1, 1, 0, 0, 1]), [[0, 2], [2, 4], [4, 4]]);
  assert.deepEqual(runs([1]), [[0, 0]]);
});

test("the chart's colours fall in lightness all the way, so that they survive greyscale", () => {
  const grey = (share) => {
    const [r, g, b] = shade(share).match(/\d+/g).map(Number);
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  for (let i = 0; i < 50; i++) assert.ok(grey(i / 50) > grey((i + 1) / 50));
});

test("a window is never narrower than its numbers can tell", () => {
  assert.ok(wideEnough([0, 1e-9, -1, 1]));
  assert.ok(!wideEnough([1, 1 + 1e-15, -1, 1]));
  assert.ok(!wideEnough([0, NaN, 0, 1]));
  assert.ok(!wideEnough([0, 1, 0, 1e200]));
});

test("the view of a notebook tells the page and the model of one another, and listens to its own frame alone", async () => {
  const { default: view } = await import("../../src/saltus/web/page/notebook.js");
  const [sent, listeners] = [[], new Set()];
  const frame = { style: {}, setAttribute() {}, remove() { frame.gone = true; }, contentWindow: { postMessage: (message) => sent.push(message.saltus) } };
  const traits = { title: "A wall", page: "<p></p>", height: 500, values: { "model.damping": 0.1 }, start: { time: 0, x: 1 }, periods: 5, results: [1] };
  const changes = {};
  let saved = 0;
  const model = {
    get: (name) => traits[name], set: (name, value) => (traits[name] = value), save_changes: () => saved++,
    on: (name, act) => (changes[name] = act), off: (name) => delete changes[name],
  };
  const says = (message, source = frame.contentWindow) => listeners.forEach((heard) => heard({ source, data: message }));
  Object.assign(globalThis, {
    document: { createElement: () => frame }, getComputedStyle: () => ({ color: "rgb(230, 230, 230)" }),
    addEventListener: (_, act) => listeners.add(act), removeEventListener: (_, act) => listeners.delete(act),
  });
  const end = view.render({ model, el: { append() {} } });
  assert.equal(frame.srcdoc, "<p></p>");
  says({ saltus: { ready: true } });
  assert.deepEqual(sent.pop(), { values: { "model.damping": 0.1 }, start: { time: 0, x: 1 }, periods: 5, results: [1], theme: "dark" });
  says({ saltus: { values: { "model.damping": 0.2 }, start: { time: 0, x: 2 }, periods: 6, page: "another" } });
  assert.deepEqual([traits.values, traits.start.x, traits.periods, traits.page, saved], [{ "model.damping": 0.2 }, 2, 6, "<p></p>", 1]);
  says({ saltus: { periods: 9 } }, {}); // of another window
  says("a text");
  assert.deepEqual([traits.periods, saved], [6, 1]);
  traits.results = [1, 2];
  changes["change:results"]();
  assert.deepEqual(sent.pop(), { results: [1, 2] });
  end();
  assert.deepEqual([Object.keys(changes).length, listeners.size, frame.gone], [0, 0, true]);
});

test("an amplitude is the largest size between samples, also where it is at an impact", () => {
  const along = (x, last) => ({ time: { first: 0, last }, state: (t) => [x(t)] });
  const wave = along((t) => Math.sin(t) + 0.3 * Math.sin(3.7 * t + 1), 40);
  let most = 0;
  for (let t = 0; t <= 40; t += 1e-4) most = Math.max(most, Math.abs(wave.state(t)[0]));
  assert.ok(Math.abs(amplitudeOf(wave, 0, 0, 2 * Math.PI) - most) < 1e-7);
  const bounces = along((t) => 2 - Math.abs((t % 1.7) - 0.61), 10); // a corner at each impact
  assert.ok(Math.abs(amplitudeOf(bounces, 0, 0, 1) - 2) < 1e-8);
});

test("motions settle under loads that repeat themselves or are constant, not under a pulse", () => {
  const under = (kind) => prepared({ ...description, load: [{ channel: "force", kind, parameters: [] }], numbers: [entry("model.damping", 0.1)] });
  assert.ok(goesOn(description));
  assert.ok(goesOn(under("Constant")));
  assert.ok(!goesOn(under("OneSine")));
});

test("a state from a link asks for no more than the page can do", () => {
  const first = firstState(description);
  const state = tamed({ ...first, periods: 1e9, speed: 1e9, coordinate: 7, selected: { result: 3, branch: 0, point: 0 }, sweep: { ...first.sweep, count: 1e9, periods: -4 } }, description);
  assert.deepEqual([state.periods, state.speed, state.coordinate, state.selected], [2000, 1000, 0, null]);
  assert.deepEqual([state.sweep.count, state.sweep.periods], [2000, 1]);
});
