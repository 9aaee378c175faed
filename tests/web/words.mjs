// What pages say: of their first motion, of its beginning and its end, of the numbers that may be changed, and of a sweep.

import { readFileSync } from "node:fs";

const [folder, file] = process.argv.slice(2);
const { open } = await import(`${folder}/engine.js`);
const { entriesOf, prepared } = await import(`${folder}/description.js`);
const { refusedNumbers, withinOthers } = await import(`${folder}/checks.js`);
const { sweepSaid } = await import(`${folder}/laboratory.js`);
const { parameterName } = await import(`${folder}/symbols.js`);
const { Sweep } = await import(`${folder}/sweep.js`);
const { validityNow, validityOfAll } = await import(`${folder}/validity.js`);
const out = [];
for (const { wasm, description: written, sweep } of JSON.parse(readFileSync(file, "utf8"))) {
  const description = prepared(written);
  const engine = await open(Buffer.from(wasm, "base64"), description);
  const entries = entriesOf(description);
  const values = Object.fromEntries(entries.map(({ path, value }) => [path, value]));
  const { periods, duration } = description.study.simulate;
  const motion = engine.simulate(engine.system(values), description.start, duration ?? 0, periods === undefined ? {} : { periods });
  motion.validity;
  const session = {
    description, motion, engine, coordinates: description.model.coordinates, refusalOf: (numbers) => refusedNumbers(entries, numbers),
    store: { state: { values, start: description.start, sweep, coordinate: 0 } },
  };
  const said = { summary: validityOfAll(session), atStart: validityNow(session, motion.time.first), atEnd: validityNow(session, motion.time.last) };
  const sliders = entries.map((entry) => {
    const { path, value } = entry;
    const [low, high] = withinOthers(entry, (other) => values[other], [entry.low, entry.high]);
    return { path, name: parameterName(path), low, high, refused: [low, value, high].map((x) => refusedNumbers(entries, { ...values, [path]: x })?.message ?? "") };
  });
  let swept = null;
  if (sweep) {
    const laboratory = new Sweep(session, () => {});
    await laboratory.start();
    const { up, down, jumps } = laboratory.result;
    swept = { said: sweepSaid(laboratory.result), up, down, jumps: jumps.map(({ way, from, to }) => [way, from.value, to.value]) };
  }
  out.push({ ...said, end: [...motion.end], stop: motion.stop, sliders, swept });
}
console.log(JSON.stringify(out));
