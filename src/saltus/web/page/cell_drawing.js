/** The unit cell of the metainterface drawn: two articulated parallelograms with a slider amid each diagonal (paper, `gen_conf`). */

/** @typedef {import("./types.js").Shape} Shape */
/** @typedef {[number, number]} Point */

export const CELL_BASE = 1.7; // length of the horizontal edges as drawn, in bar lengths: no number of the model depends on it

/**
 * The corners, sliders and masses of a cell, in bar lengths from its lower left hinge; `theta1` >= 0 opens the lower layer and
 * `theta2` <= 0 the upper one.
 * @param {number} beta0 @param {number} theta1 @param {number} theta2
 */
export function cellPoints(beta0, theta1, theta2) {
  const alpha0 = Math.atan2(Math.sin(beta0), CELL_BASE - Math.cos(beta0)); // of a triangle with this base
  const half = Math.sin(beta0) / (2 * Math.sin(alpha0));
  const psi = Math.sin(beta0) ** 2 / (2 * Math.sin(alpha0) * Math.sin(alpha0 + beta0));
  const [beta1, beta2] = [beta0 + theta1, beta0 - theta2];
  /** @type {Point} */ const lowerLeft = [0, 0];
  const middleLeft = plus(lowerLeft, [-Math.cos(beta1), Math.sin(beta1)]);
  const upperLeft = plus(middleLeft, [Math.cos(beta2), Math.sin(beta2)]);
  const [lowerRight, middleRight, upperRight] = /** @type {[Point, Point, Point]} */ (
    [lowerLeft, middleLeft, upperLeft].map((corner) => plus(corner, [CELL_BASE, 0]))
  );
  const slider1 = sliderAmid(lowerLeft, middleRight, half, misalignment(beta0, beta1, psi));
  const slider2 = sliderAmid(middleRight, upperLeft, half, misalignment(beta0, beta2, psi));
  const mass1 = plus(middleLeft, [CELL_BASE / 2, 0]);
  const mass2 = plus(upperLeft, [CELL_BASE / 2, 0]);
  return { lowerLeft, lowerRight, middleLeft, middleRight, upperLeft, upperRight, slider1, slider2, mass1, mass2 };
}

/** phi of tan(phi)^2 = (cos(beta0) - cos(beta)) / psi; 0 past the kinematic limit, where there is none. @param {number} beta0 @param {number} beta @param {number} psi */
function misalignment(beta0, beta, psi) {
  return Math.atan(Math.sqrt(Math.max(Math.cos(beta0) - Math.cos(beta), 0) / psi));
}

/** @param {Point} start @param {Point} end @param {number} half @param {number} phi @returns {[Point, Point]} */
function sliderAmid(start, end, half, phi) {
  const length = Math.hypot(end[0] - start[0], end[1] - start[1]) || 1;
  const [ux, uy] = [(end[0] - start[0]) / length, (end[1] - start[1]) / length];
  /** @type {Point} */
  const turned = [half * (Math.cos(phi) * ux - Math.sin(phi) * uy), half * (Math.sin(phi) * ux + Math.cos(phi) * uy)];
  return [plus(start, turned), [end[0] - turned[0], end[1] - turned[1]]];
}

/**
 * A cell as shapes, with its lower left hinge at `at`.
 * @param {number} beta0 @param {number} theta1 @param {number} theta2 @param {Point} at
 */
export function cellShapes(beta0, theta1, theta2, at) {
  const found = cellPoints(beta0, theta1, theta2);
  const p = /** @type {typeof found} */ (
    Object.fromEntries(
      Object.entries(found).map(([name, value]) => [
        name,
        name.startsWith("slider") ? /** @type {Point[]} */ (value).map((each) => plus(each, at)) : plus(/** @type {Point} */ (value), at),
      ]),
    )
  );
  /** @type {[Point, Point][]} */
  const bars = [
    [p.lowerLeft, p.lowerRight], [p.lowerLeft, p.middleLeft], [p.lowerRight, p.middleRight], [p.middleLeft, p.middleRight],
    [p.middleLeft, p.upperLeft], [p.middleRight, p.upperRight], [p.upperLeft, p.upperRight], [p.lowerLeft, p.slider1[0]],
    [p.slider1[1], p.middleRight], [p.middleRight, p.slider2[0]], [p.slider2[1], p.upperLeft],
  ];
  const hinges = [p.lowerLeft, p.lowerRight, p.middleLeft, p.middleRight, p.upperLeft, p.upperRight];
  /** @type {Shape[]} */
  const shapes = [
    ...bars.map((points) => ({ kind: "line", points, role: "bar" })),
    ...plates(p.slider1, p.lowerLeft),
    ...plates(p.slider2, p.middleRight),
    ...hinges.map((point) => ({ kind: "circle", points: [point], radius: 0.036, role: "hinge" })),
    spiral(p.lowerRight, beta0 + theta1),
    spiral(p.upperRight, beta0 - theta2),
    { kind: "circle", points: [p.mass1], radius: 0.085, role: "mass" },
    { kind: "circle", points: [p.mass2], radius: 0.085, role: "mass" },
  ];
  return { shapes, points: p };
}

/** The two plates of a slider, across the halves of the diagonal. @param {[Point, Point]} slider @param {Point} hinge @returns {Shape[]} */
function plates(slider, hinge) {
  const [first, last] = slider;
  const length = Math.hypot(first[0] - hinge[0], first[1] - hinge[1]) || 1;
  const [ux, uy] = [(first[0] - hinge[0]) / length, (first[1] - hinge[1]) / length];
  return [[first, -1], [last, 1]].map(([end, sign]) => {
    const [x, y] = /** @type {Point} */ (end);
    const gap = 0.03 * /** @type {number} */ (sign);
    const points = [-0.16, 0.16].map((across) => [x + gap * ux - across * uy, y + gap * uy + across * ux]);
    return { kind: "line", points, role: "slider" };
  });
}

/** A spiral spring about a hinge, which winds with the angle. @param {Point} at @param {number} angle @returns {Shape} */
function spiral(at, angle) {
  const turns = 4.2 * Math.PI + angle;
  const points = Array.from({ length: 60 }, (_, i) => {
    const turn = (i / 59) * turns;
    const radius = 0.05 + 0.085 * (i / 59);
    return [at[0] + radius * Math.cos(turn), at[1] + radius * Math.sin(turn)];
  });
  return { kind: "polyline", points, role: "spring" };
}

/** @param {Point} a @param {Point} b @returns {Point} */
function plus(a, b) {
  return [a[0] + b[0], a[1] + b[1]];
}
