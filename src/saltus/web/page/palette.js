/**
 * Colours and lines. They are those of Python's pictures: stable is a solid blue line, unstable a dashed red one, a limit of the
 * mechanism dash-dotted green, a separatrix dashed grey; no two share both a dash and a lightness.
 */

/**
 * @typedef {object} Palette
 * @property {string} paper @property {string} ink @property {string} soft @property {string} faint @property {string} stable
 * @property {string} unstable @property {string} limit @property {string} separatrix @property {string} pale
 * @property {string} bar @property {string} flash @property {string[]} basins @property {string} serif @property {string} sans
 */

const NAMES = ["paper", "ink", "soft", "faint", "stable", "unstable", "limit", "separatrix", "pale", "bar", "flash"];

/** @type {Palette|null} */
let kept = null;

/** The colours that the style sheet gives now. */
export function currentPalette() {
  kept ??= readPalette();
  return kept;
}

/** Other colours are in use from now on. */
export function forgetPalette() {
  kept = null;
}

/** @returns {Palette} */
function readPalette() {
  const style = getComputedStyle(document.documentElement);
  const read = (/** @type {string} */ name) => style.getPropertyValue(`--${name}`).trim();
  const found = Object.fromEntries(NAMES.map((name) => [name, read(name)]));
  const basins = [0, 1, 2, 3, 4, 5, 6].map((i) => read(`basin-${i}`));
  return /** @type {Palette} */ ({ ...found, basins, serif: read("serif"), sans: read("sans") });
}

/** @typedef {{color: string, width: number, dash?: number[], alpha?: number}} Line */

/** A branch's line: stable or not. @param {Palette} palette @param {boolean} stable @returns {Line} */
export function branchLine(palette, stable) {
  return stable ? { color: palette.stable, width: 1.8 } : { color: palette.unstable, width: 1.5, dash: [6, 3.5] };
}
