/** Whether the model is to be believed: at the time that is shown, and over the whole motion. */

import { shortly } from "./numbers.js";

/** @typedef {import("./session.js").Session} Session */

/** What it means to pass a margin, by its kind. @type {Record<string, string>} */
const MEANING = {
  landmark: "a landmark has been passed; the model still holds",
  assumption: "an assumption of the model fails here: do not believe the motion from here on",
  limit: "a limit of the mechanism has been passed: no such mechanism can be built",
};

/** Why motions end, in words. @type {Record<string, string>} */
const STOPS = {
  horizon: "", rest: "It has come to rest.", limit: "It ends where a margin of the model reaches zero.",
  captured: "It is captured at rest for all later loads.", settled: "It repeats itself.",
  not_unique: "It ends: the motion from rest at contact is not unique.",
  no_impact: "It ends: the impact law has no velocity after the impact.",
  not_finite: "It ends: the motion leaves the range of numbers.", stalled: "It ends: the acceleration is singular.",
  singular: "It ends: the mass matrix has no inverse.", outside: "There is no motion: the state at the start lies beyond the contact.",
  unresolved: "It ends: impacts accumulate too slowly to be followed.",
  unfinished: "It is not followed further here, as that takes too long; Python follows it to its end.",
};

/** The margins that are passed at a time. @param {Session} session @param {number} time */
export function passedAt(session, time) {
  const margins = session.motion?.margins?.(time);
  if (!margins) return [];
  return (session.description.model.margins ?? []).filter(({ name }) => (margins[name] ?? 1) < 0);
}

/** What is said of the moment: its kind (for the colour) and a sentence. @param {Session} session @param {number} time */
export function validityNow(session, time) {
  const passed = passedAt(session, time);
  if (!passed.length) {
    const known = session.motion?.margins?.(time);
    const any = known && Object.keys(known).length;
    return { kind: "fine", text: any ? "The model holds at this moment." : "" };
  }
  const worst = ["limit", "assumption", "landmark"].find((kind) => passed.some((each) => each.kind === kind)) ?? "assumption";
  const names = passed.map(({ name }) => name.replace(/_/g, " ")).join(", ");
  const first = passed.find(({ kind }) => kind === worst);
  return { kind: worst, text: `Past ${names}: ${first?.meaning || MEANING[worst]}.` };
}

/** What is said of the whole motion. @param {Session} session */
export function validityOfAll(session) {
  const { motion } = session;
  if (!motion) return "";
  const known = motion.checked === undefined ? motion.validity : motion.checked;
  const parts = Object.entries(known?.first ?? {}).map(([name, time]) => {
    const share = known?.share[name] ?? 0;
    const words = name.replace(/_/g, " ");
    return time === null ? `${words} respected` : `${words} passed first at ${shortly(time)}, ${shortly(100 * share, 3)} % of the time`;
  });
  const ended = STOPS[motion.stop] ?? motion.stop;
  const why = motion.reason && ended && !["rest", "horizon"].includes(motion.stop) ? `${ended} (${motion.reason})` : ended;
  const impacts = motion.events.filter((event) => event.kind === "impact").length;
  const counted = `${impacts} impact${impacts === 1 ? "" : "s"} up to time ${shortly(motion.time.last)}.`;
  return [counted, why, parts.length ? `${parts.join("; ")}.` : ""].filter(Boolean).join(" ");
}
