/** Whether the model is to be believed: at the time that is shown, and over the whole motion. */

import { shortly } from "./numbers.js";

/** @typedef {import("./session.js").Session} Session */

/** What it means to pass a margin, by its kind. @type {Record<string, string>} */
const MEANING = {
  landmark: "a landmark has been passed; the model still holds",
  assumption: "an assumption of the model fails here: do not believe the motion from here on",
  limit: "the mechanism has no such positions",
};

/** What ends a motion, where it is more than a margin: by the margin's name. @type {Record<string, string>} */
const ENDS = { overturned: "The block overturns" };

/** The name of a margin in words. @param {string} name */
const inWords = (name) => name.replace(/_/g, " ");

/** How a motion ends on the margin that ends it. @param {import("./types.js").Motion} motion */
function endOnMargin(motion) {
  const time = shortly(motion.time.last);
  const what = ENDS[motion.limit ?? ""];
  if (what) return `${what} at ${time}.`;
  return motion.limit ? `It ends at ${time}, where the margin “${inWords(motion.limit)}” reaches zero.` : "It ends where a margin of the model reaches zero.";
}

/** Why motions end, in words. @type {Record<string, string>} */
const STOPS = {
  horizon: "", rest: "It has come to rest.",
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
  const { motion } = session;
  const end = motion?.stop === "limit" ? (motion.limit ?? "") : "";
  // by rounding the margin that ends a motion may be on either side of zero there
  if (end && (time >= (motion?.time.last ?? Infinity) || passed.some(({ name }) => name === end))) {
    return { kind: "limit", text: `${ENDS[end] ?? `The margin “${inWords(end)}” is zero`} here: the motion ends.` };
  }
  if (!passed.length) {
    const known = motion?.margins?.(time);
    const any = known && Object.keys(known).length;
    return { kind: "fine", text: any ? "The model holds at this moment." : "" };
  }
  const worst = ["limit", "assumption", "landmark"].find((kind) => passed.some((each) => each.kind === kind)) ?? "assumption";
  const names = passed.map(({ name }) => inWords(name)).join(", ");
  const first = passed.find(({ kind }) => kind === worst);
  return { kind: worst, text: `Past ${names}: ${first?.meaning || MEANING[worst]}.` };
}

/** What is said of the whole motion. @param {Session} session */
export function validityOfAll(session) {
  const { motion } = session;
  if (!motion) return "";
  const known = motion.checked === undefined ? motion.validity : motion.checked;
  // what ends the motion is said once, and is not "not passed" where rounding leaves it above zero
  const others = Object.entries(known?.first ?? {}).filter(([name]) => motion.stop !== "limit" || name !== motion.limit);
  const parts = others.map(([name, time]) => {
    const share = known?.share[name] ?? 0;
    return time === null ? `${inWords(name)}: not passed` : `${inWords(name)}: passed first at ${shortly(time)}, ${shortly(100 * share, 3)} % of the time`;
  });
  const ended = motion.stop === "limit" ? endOnMargin(motion) : (STOPS[motion.stop] ?? motion.stop);
  const why = motion.reason && ended && !["rest", "horizon", "limit"].includes(motion.stop) ? `${ended} (${motion.reason})` : ended;
  const impacts = motion.events.filter((event) => event.kind === "impact").length;
  const counted = `${impacts} impact${impacts === 1 ? "" : "s"} up to time ${shortly(motion.time.last)}.`;
  return [counted, why, parts.length ? `${parts.join("; ")}.` : ""].filter(Boolean).join(" ");
}
