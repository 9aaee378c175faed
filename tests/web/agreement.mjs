// Follows the motions of a list of systems and prints what Python compares: events, the state at the end, and states between.

import { readFileSync } from "node:fs";

const [engineAddress, file] = process.argv.slice(2);
const { open } = await import(engineAddress);
const tasks = JSON.parse(readFileSync(file, "utf8"));
const out = [];
for (const { wasm, description, motions } of tasks) {
  const engine = await open(Buffer.from(wasm, "base64"), description);
  out.push(
    motions.map(({ values, start, duration, periods, at }) => {
      const motion = engine.simulate(engine.system(values), start, duration ?? 0, periods === undefined ? {} : { periods });
      const { stop, reason, end, time } = motion;
      const events = motion.events.map((event) => [event.time, event.kind, event.contact, event.before, event.after]);
      const energies = at.map((t) => motion.energy(t));
      return { stop, reason, end: [...end], last: time.last, events, states: at.map((t) => [...motion.state(t)]), energies, validity: motion.validity, drawings: at.map((t) => engine.drawing(motion.system, motion.state(t), t)) };
    }),
  );
}
console.log(JSON.stringify(out));
