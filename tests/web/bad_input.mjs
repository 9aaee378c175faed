// Damaged links, and links that are whole but ask for what cannot be: what the page makes of them, with the real engine.

import { readFileSync } from "node:fs";

const [pages, file] = process.argv.slice(2);
const load = (name) => import(`${pages}/${name}.js`);
const { open } = await load("engine");
const { prepared, firstState, tamed } = await load("description");
const { linkOf, stateOf } = await load("link");
const { Session } = await load("session");
const { Store } = await load("store");

const { wasm, description: written, damaged, extremes } = JSON.parse(readFileSync(file, "utf8"));
const engine = await open(Buffer.from(wasm, "base64"), written);
const description = prepared(written);
const first = firstState(description);

let seed = 7;
const random = () => (seed = (seed * 16807) % 2147483647) / 2147483647;
const pick = (list) => list[Math.floor(random() * list.length)];
const LETTERS = "0123456789.-eE+&=_abcxyzNaI%#<>\u0000\u03b8";

/** A link that is damaged at one to four places. */
function damage(link) {
  let text = link;
  for (let i = Math.ceil(random() * 4); i > 0; i--) {
    const at = Math.floor(random() * (text.length + 1));
    const way = random();
    if (way < 0.4) text = text.slice(0, at) + pick(LETTERS) + text.slice(at + 1);
    else if (way < 0.6) text = text.slice(0, at) + text.slice(at + 1);
    else if (way < 0.8) text = text.slice(0, at) + pick(LETTERS) + text.slice(at);
    else text = text.slice(0, at);
  }
  return text;
}

const whole = linkOf({ ...first, values: { ...first.values, "model.damping": 0.17 }, cursor: 3.5, periods: 12, windows: { phase: [-1, 1, -2, 2] } }, first, description);
const answers = { refused: 0, same: 0, other: [] };
for (let i = 0; i < damaged; i++) {
  const link = damage(whole);
  const found = stateOf(link, first, description);
  if (link === whole || link === "") answers.same++;
  else if ("refusal" in found) answers.refused++;
  else answers.other.push(link);
}

/** A number of any size, now and then none. */
function extreme(value) {
  const way = random();
  if (way < 0.3) return value * (0.5 + random());
  if (way < 0.35) return pick([NaN, Infinity, -Infinity]);
  return (random() < 0.3 ? -1 : 1) * 10 ** (-308 + 616 * random() ** (random() < 0.5 ? 1 : 0.1));
}

const kinds = { refused: 0, whole: 0, ended: 0 };
const wrong = [];
let slowest = 0;
for (let i = 0; i < extremes; i++) {
  const state = structuredClone(first);
  const paths = Object.keys(state.values);
  for (let k = Math.ceil(random() * 3); k > 0; k--) {
    if (random() < 0.6) state.values[pick(paths)] = extreme(state.values[pick(paths)]);
    else state.start[pick(Object.keys(state.start))] = extreme(0.5);
  }
  if (random() < 0.2) state.periods = extreme(20);
  const from = performance.now();
  const asked = JSON.stringify([state.values, state.start, state.periods]);
  const linked = stateOf(linkOf(state, first, description), first, description);
  if ("refusal" in linked) {
    kinds.refused++;
    continue;
  }
  const session = new Session(engine, description, new Store(tamed(linked.state, description)));
  session.compute();
  slowest = Math.max(slowest, performance.now() - from);
  const { motion, refusal } = session;
  if (refusal) {
    kinds.refused++;
    if (!refusal.message || motion) wrong.push([asked, refusal.message]);
    continue;
  }
  const on = motion.stop === "horizon" || motion.stop === "rest";
  kinds[on ? "whole" : "ended"]++;
  const finite = session.column(description.model.coordinates[0].name).every(Number.isFinite) && Number.isFinite(motion.time.last);
  if (!finite && on) wrong.push([asked, motion.stop, "not finite"]);
  if (!on && !(motion.reason || motion.meaning)) wrong.push([asked, motion.stop, "no reason"]);
}
console.log(JSON.stringify({ answers, kinds, wrong: wrong.slice(0, 5), wrongs: wrong.length, slowest }));
