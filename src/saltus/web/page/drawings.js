/** The mechanisms drawn: for each library model its shapes at a state, in lengths of its own, with y upwards. */

import { CELL_BASE, cellShapes } from "./cell_drawing.js";
import { roundStep } from "./numbers.js";

/** @typedef {import("./types.js").Shape} Shape */
/** @typedef {[number, number]} Point */
/** @typedef {[number, number, number, number]} Box  Least and largest x, least and largest y. */

/**
 * @typedef {object} Scene  What a drawing is made of.
 * @property {Record<string, number>} values  All numbers by their paths.
 * @property {ArrayLike<number>} state  Coordinates, then velocities.
 * @property {number} time
 * @property {number[]} reach  The largest size of each coordinate in the motion.
 * @property {(channel: string) => number} load
 * @property {string[]} channels  The load channels that act.
 */

/** @typedef {{shapes: Shape[], box: Box, note?: string}} Picture */

/** @type {Record<string, (scene: Scene) => Picture>} */
const DRAWINGS = {
  Metainterface: reducedCell, TwoLayer: bothLayers, CellChain: chain,
  RockingBlock: block, WallOscillator: atWall, TwoStops: betweenStops, ImpactPair: pair, BeltOscillator: onBelt,
};

/** Whether a model's mechanism is drawn here. @param {string} model */
export function isDrawn(model) {
  return model in DRAWINGS;
}

/** The picture of a model at a state; null where the model has none here. @param {string} model @param {Scene} scene */
export function pictureOf(model, scene) {
  return DRAWINGS[model]?.(scene) ?? null;
}

/** @param {Scene} scene @param {string} name @param {number} otherwise */
function number(scene, name, otherwise) {
  return scene.values[`model.${name}`] ?? otherwise;
}

/** @param {ArrayLike<number>} state @param {number} i */
function at(state, i) {
  return state[i] ?? 0;
}

// --- cells ---------------------------------------------------------------------------------------------------------------

/** @param {Scene} scene @returns {Picture} */
function reducedCell(scene) {
  const theta = at(scene.state, 0);
  return oneCell(scene, Math.max(theta, 0), Math.min(theta, 0));
}

/** @param {Scene} scene @returns {Picture} */
function bothLayers(scene) {
  return oneCell(scene, at(scene.state, 0), at(scene.state, 1));
}

/** @param {Scene} scene @param {number} theta1 @param {number} theta2 @returns {Picture} */
function oneCell(scene, theta1, theta2) {
  const beta0 = number(scene, "beta0", 1.4);
  const ground = groundOf(scene);
  const { shapes, points } = cellShapes(beta0, theta1, theta2, ground);
  const arrows = [
    ...forces(points.mass2, scene.load("horizontal"), scene.load("vertical")),
    ...forces(points.mass1, scene.load("lower_horizontal"), scene.load("lower_vertical")),
  ];
  const closed = [theta1 === 0 ? points.slider1 : null, theta2 === 0 ? points.slider2 : null];
  const marks = closed.flatMap((slider) => (slider ? [closedMark(slider)] : []));
  const all = [...support([ground[0], ground[0] + CELL_BASE], ground[1]), ...marks, ...shapes, ...arrows];
  return { shapes: all, box: [-1.35, CELL_BASE + 1.35, -0.95, 2.55], note: beyondNote(beta0, theta1, theta2) };
}

/** @param {Scene} scene @returns {Picture} */
function chain(scene) {
  const beta0 = number(scene, "beta0", 1.4);
  const count = Math.floor(scene.state.length / 4);
  const pitch = CELL_BASE + 1.5;
  const ground = groundOf(scene);
  /** @type {Shape[]} */
  const shapes = [];
  /** @type {ReturnType<typeof cellShapes>["points"][]} */
  const cells = [];
  for (let i = 0; i < count; i++) {
    const [theta1, theta2] = [at(scene.state, 2 * i), at(scene.state, 2 * i + 1)];
    const found = cellShapes(beta0, theta1, theta2, [ground[0] + i * pitch, ground[1]]);
    shapes.push(...support([ground[0] + i * pitch, ground[0] + i * pitch + CELL_BASE], ground[1]), ...found.shapes);
    shapes.push(...forces(found.points.mass2, scene.load("horizontal"), scene.load("vertical")));
    cells.push(found.points);
  }
  for (let i = 0; i + 1 < count; i++) {
    for (const name of /** @type {const} */ (["mass1", "mass2"])) {
      const [from, to] = [cells[i]?.[name], cells[i + 1]?.[name]];
      if (from && to) shapes.push(coil(shifted(from, 0.1, 0.14), shifted(to, -0.1, 0.14), 18, 0.07, "coupling"));
    }
  }
  return { shapes, box: [-1.2, (count - 1) * pitch + CELL_BASE + 1.2, -0.6, 2.5] };
}

/** A ring about a slider that is closed. @param {[Point, Point]} slider @returns {Shape} */
function closedMark(slider) {
  const [a, b] = slider;
  return { kind: "circle", points: [[(a[0] + b[0]) / 2, (a[1] + b[1]) / 2]], radius: 0.23, role: "closed" };
}

/** @param {number} beta0 @param {number} theta1 @param {number} theta2 */
function beyondNote(beta0, theta1, theta2) {
  const limit = 2 * (Math.PI - beta0);
  return Math.max(Math.abs(theta1), Math.abs(theta2)) > limit ? "Past the kinematic limit: no such cell can be built." : undefined;
}

/** The ground's displacement, in the lengths of the drawing. @param {Scene} scene @returns {Point} */
function groundOf(scene) {
  return [limited(scene.load("ground_horizontal"), 1.1), limited(scene.load("ground_vertical"), 0.6)];
}

// --- the block -----------------------------------------------------------------------------------------------------------

/** @param {Scene} scene @returns {Picture} */
function block(scene) {
  const alpha = number(scene, "alpha", 0.3);
  const theta = at(scene.state, 0);
  const [half, height] = [Math.sin(alpha), 2 * Math.cos(alpha)];
  const [shift, lift] = groundOf(scene);
  const pivot = theta >= 0 ? half : -half;
  const [cos, sin] = [Math.cos(-theta), Math.sin(-theta)];
  const corners = [[-half, 0], [half, 0], [half, height], [-half, height]].map(([x, y]) => {
    const [dx, dy] = [(x ?? 0) - pivot, y ?? 0];
    return [shift + pivot + cos * dx - sin * dy, lift + sin * dx + cos * dy];
  });
  const middle = [((corners[0]?.[0] ?? 0) + (corners[2]?.[0] ?? 0)) / 2, ((corners[0]?.[1] ?? 0) + (corners[2]?.[1] ?? 0)) / 2];
  /** @type {Shape[]} */
  const shapes = [
    ...hatched(shift - 1.7, shift + 1.7, lift),
    { kind: "polygon", points: corners, role: "body" },
    { kind: "line", points: [[shift + pivot, lift], middle], role: "ghost" },
    { kind: "circle", points: [middle], radius: 0.045, role: "mass" },
    { kind: "circle", points: [[shift + pivot, lift]], radius: 0.035, role: "hinge" },
  ];
  return { shapes, box: [-2.6, 2.6, -0.5, 2.4] };
}

// --- oscillators ---------------------------------------------------------------------------------------------------------

/** A round length that reaches over the motion. @param {Scene} scene @param {number} i @param {number} least */
function reachOf(scene, i, least) {
  return roundStep(Math.max(scene.reach[i] ?? 0, Math.abs(least), 0.1) * 1.05);
}

/** @param {Scene} scene @returns {Picture} */
function atWall(scene) {
  const wall = number(scene, "wall", 1);
  const reach = reachOf(scene, 0, wall);
  const size = 0.26 * reach;
  const x = at(scene.state, 0);
  const left = -2.1 * reach - 2 * size;
  const shapes = [
    ...floor(left, wall + 0.5 * reach, -size),
    ...upright(left, -size, 1.6 * size, -1),
    ...upright(wall, -size, 1.6 * size, 1),
    ...tied(scene, left, x - 2 * size, size),
    mass(x - size, size),
    ...along(x - size, 1.9 * size, scene.load("force"), reach),
  ];
  return { shapes, box: [left - 0.35 * reach, Math.max(wall, 0.5 * reach) + 0.5 * reach, -1.0 * reach, 1.0 * reach] };
}

/** @param {Scene} scene @returns {Picture} */
function betweenStops(scene) {
  const [left, right] = [number(scene, "left", -1), number(scene, "right", 1)];
  const room = right - left;
  const size = 0.13 * room;
  const x = at(scene.state, 0);
  const anchor = left - 1.1 * room;
  const shapes = [
    ...floor(anchor, right + 0.35 * room, -size),
    ...upright(anchor, -size, 1.6 * size, -1),
    stop(left - size, size, -1), stop(right + size, size, 1),
    ...tied(scene, anchor, x - size, size, 0.62),
    mass(x, size),
    ...along(x, 2 * size, scene.load("force"), room),
  ];
  return { shapes, box: [anchor - 0.2 * room, right + 0.5 * room, -0.7 * room, 0.7 * room] };
}

/** @param {Scene} scene @returns {Picture} */
function pair(scene) {
  const gap = number(scene, "clearance", 1);
  const [z, x] = [at(scene.state, 0), at(scene.state, 1)];
  const reach = Math.max(reachOf(scene, 0, 0), gap);
  const size = 0.14 * gap;
  const [inner, tall] = [gap + size, Math.max(3 * size, 0.12 * reach)];
  const anchor = -(reach + inner + 1.4 * gap);
  const thick = 0.5 * size;
  const walls = [z - inner - thick, z + inner + thick];
  /** @type {Shape[]} */
  const shapes = [
    ...floor(anchor, reach + inner + gap, -tall - thick),
    ...upright(anchor, -tall - thick, tall, -1),
    ...tied(scene, anchor, walls[0] ?? 0, size),
    { kind: "polygon", points: rectangle(walls[0] ?? 0, walls[1] ?? 0, -tall - thick, tall), role: "body" },
    { kind: "polygon", points: rectangle(z - inner, z + inner, -tall, tall - thick), role: "hollow" },
    { kind: "circle", points: [[z + x, -tall + size]], radius: size, role: "mass" },
    ...along(z, tall + size, scene.load("force"), reach),
  ];
  return { shapes, box: [anchor - 0.2 * Math.max(gap, 0.4 * reach), reach + inner + gap, -1.6 * gap, 1.6 * gap] };
}

/** @param {Scene} scene @returns {Picture} */
function onBelt(scene) {
  const reach = Math.max(reachOf(scene, 0, 0), 0.3);
  const size = 0.22 * reach;
  const x = at(scene.state, 0);
  const [left, right] = [-1.5 * reach, 1.9 * reach];
  const radius = 0.28 * reach;
  const moved = number(scene, "belt_speed", 0) * scene.time;
  const pitch = reach / 4;
  const teeth = Array.from({ length: Math.round((right - left) / pitch) }, (_, i) => {
    const place = left + ((((i * pitch + moved) % (right - left)) + (right - left)) % (right - left));
    return { kind: "line", points: [[place, -size], [place - 0.06 * reach, -size - 0.07 * reach]], role: "hatch" };
  });
  const anchor = -2.4 * reach;
  /** @type {Shape[]} */
  const shapes = [
    { kind: "line", points: [[left, -size], [right, -size]], role: "ground" },
    { kind: "line", points: [[left, -size - 2 * radius], [right, -size - 2 * radius]], role: "ground" },
    ...[left, right].flatMap((place) => roller(place, -size - radius, radius, moved / radius)),
    ...teeth,
    ...upright(anchor, -size, 1.6 * size, -1),
    ...tied(scene, anchor, x - size, size),
    mass(x, size),
    ...along(x + Math.sign(scene.load("force")) * size, 0, scene.load("force"), reach),
    arrow([x, 3.4 * size], [x, 1.5 * size]),
  ];
  return { shapes, box: [anchor - 0.3 * reach, right + 0.5 * reach, -1.4 * reach, 1.2 * reach] };
}

// --- parts ---------------------------------------------------------------------------------------------------------------

/** @param {number} x0 @param {number} x1 @param {number} y0 @param {number} y1 */
function rectangle(x0, x1, y0, y1) {
  return [[x0, y0], [x1, y0], [x1, y1], [x0, y1]];
}

/** @param {number} x @param {number} size @returns {Shape} */
function mass(x, size) {
  return { kind: "polygon", points: rectangle(x - size, x + size, -size, size), role: "body" };
}

/** @param {number} face @param {number} size @param {number} side @returns {Shape} */
function stop(face, size, side) {
  return { kind: "polygon", points: rectangle(face, face + side * 0.6 * size, -size, -0.1 * size), role: "wall" };
}

/** A wheel of the belt with a spoke that turns. @param {number} x @param {number} y @param {number} radius @param {number} turn @returns {Shape[]} */
function roller(x, y, radius, turn) {
  const spoke = [x + 0.8 * radius * Math.cos(-turn), y + 0.8 * radius * Math.sin(-turn)];
  return [
    { kind: "circle", points: [[x, y]], radius, role: "wheel" },
    { kind: "line", points: [[x, y], spoke], role: "ghost" },
  ];
}

/** A spring, and beside it a dashpot where there is damping, from `left` to `right`; `above`, in sizes, is how high they are held. @param {Scene} scene @param {number} left @param {number} right @param {number} size @param {number} [above] @returns {Shape[]} */
function tied(scene, left, right, size, above = 0) {
  const damped = number(scene, "damping", 0) > 0;
  const high = (damped && !above ? 0.5 : above) * size;
  /** @type {Shape[]} */
  const parts = [];
  if (number(scene, "stiffness", 1) > 0) parts.push(coil([left, high], [right, high], 14, (above ? 0.2 : 0.32) * size, "spring"));
  if (damped) {
    const [a, b] = [left + 0.42 * (right - left), left + 0.58 * (right - left)];
    const [y, h] = above ? [0.18 * size, 0.16 * size] : [-0.55 * size, 0.26 * size];
    parts.push({ kind: "line", points: [[left, y], [a + 0.5 * (b - a), y]], role: "thin" });
    parts.push({ kind: "line", points: [[a + 0.5 * (b - a), y - 0.7 * h], [a + 0.5 * (b - a), y + 0.7 * h]], role: "thin" });
    parts.push({ kind: "polyline", points: [[a, y + h], [b, y + h], [b, y - h], [a, y - h]], role: "thin" });
    parts.push({ kind: "line", points: [[b, y], [right, y]], role: "thin" });
  }
  return parts;
}

/** @param {number[]} from @param {number[]} to @param {number} turns @param {number} width @param {string} role @returns {Shape} */
function coil(from, to, turns, width, role) {
  const [x0, y0] = [from[0] ?? 0, from[1] ?? 0];
  const [dx, dy] = [(to[0] ?? 0) - x0, (to[1] ?? 0) - y0];
  const length = Math.hypot(dx, dy) || 1;
  const points = Array.from({ length: turns + 3 }, (_, i) => {
    const share = i === 0 ? 0 : i === turns + 2 ? 1 : 0.12 + (0.76 * (i - 1)) / turns;
    const across = i <= 1 || i >= turns + 1 ? 0 : (i % 2 ? 1 : -1) * width;
    return [x0 + share * dx - (across * dy) / length, y0 + share * dy + (across * dx) / length];
  });
  return { kind: "polyline", points, role };
}

/** @param {number} left @param {number} right @param {number} y @returns {Shape[]} */
function floor(left, right, y) {
  return [{ kind: "line", points: [[left, y], [right, y]], role: "thin" }];
}

/** A wall with hatching behind it. @param {number} x @param {number} low @param {number} high @param {number} side @returns {Shape[]} */
function upright(x, low, high, side) {
  const step = (high - low) / 6;
  const hatch = Array.from({ length: 6 }, (_, i) => ({
    kind: "line", points: [[x, low + (i + 0.6) * step], [x + side * step * 0.8, low + (i + 0.1) * step]], role: "hatch",
  }));
  return [...hatch, { kind: "line", points: [[x, low], [x, high]], role: "ground" }];
}

/** Ground with hatching below it. @param {number} left @param {number} right @param {number} y @returns {Shape[]} */
function hatched(left, right, y) {
  const count = Math.round((right - left) / 0.12);
  const hatch = Array.from({ length: count }, (_, i) => {
    const x = left + ((i + 0.7) * (right - left)) / count;
    return { kind: "line", points: [[x, y], [x - 0.08, y - 0.1]], role: "hatch" };
  });
  return [...hatch, { kind: "line", points: [[left, y], [right, y]], role: "ground" }];
}

/** The two supports of a cell and the ground below them. @param {[number, number]} feet @param {number} y @returns {Shape[]} */
function support(feet, y) {
  const legs = feet.map((x) => ({ kind: "polygon", points: [[x, y], [x - 0.09, y - 0.14], [x + 0.09, y - 0.14]], role: "support" }));
  return [...hatched(feet[0] - 0.3, feet[1] + 0.3, y - 0.14), ...legs];
}

/** The load on a mass as two arrows. @param {Point} from @param {number} across @param {number} along_ @returns {Shape[]} */
function forces(from, across, along_) {
  const [h, v] = [limited(across, 1.1), limited(along_, 0.8)];
  /** @type {Shape[]} */
  const arrows = [];
  if (Math.abs(h) > 1e-3) arrows.push(arrow(from, [from[0] + h, from[1]]));
  if (v > 1e-3) arrows.push(arrow(from, [from[0], from[1] + v]));
  if (v < -1e-3) arrows.push(arrow([from[0], from[1] - v + 0.12], [from[0], from[1] + 0.12]));
  return arrows;
}

/** A force on a mass along x. @param {number} x @param {number} y @param {number} force @param {number} reach @returns {Shape[]} */
function along(x, y, force, reach) {
  const size = limited(force, 1.2) * 0.7 * reach;
  return Math.abs(size) > 1e-3 * reach ? [arrow([x, y], [x + size, y])] : [];
}

/** @param {number[]} from @param {number[]} to @returns {Shape} */
function arrow(from, to) {
  return { kind: "arrow", points: [from, to], role: "load" };
}

/** A number that grows with `value` but stays below `most`. @param {number} value @param {number} most */
function limited(value, most) {
  return Number.isFinite(value) ? most * Math.tanh(value / most) : 0;
}

/** @param {Point} point @param {number} dx @param {number} dy */
function shifted(point, dx, dy) {
  return [point[0] + dx, point[1] + dy];
}
