/** Names as mathematical symbols: Greek letters, subscripts, dots; drawn on a canvas and written into elements. */

/** @typedef {{text: string, italic: boolean, sub: string, dots: number, hat: boolean}} Symbol_ */

/** @type {Record<string, string>} */
const GREEK = {
  alpha: "α", beta: "β", gamma: "γ", delta: "δ", epsilon: "ε", zeta: "ζ", eta: "η", theta: "θ", kappa: "κ", lambda: "λ",
  mu: "μ", nu: "ν", xi: "ξ", rho: "ρ", sigma: "σ", tau: "τ", phi: "φ", chi: "χ", psi: "ψ", omega: "ω", Omega: "Ω",
};

/** The symbols of paths that have one in the paper. @type {Record<string, string>} */
const OF_PATHS = {
  "load.frequency": "Omega",
  "impact.e": "e",
  "impact.r": "r",
  "model.beta0": "beta_0",
  "model.alpha": "alpha",
  "model.damping": "C",
  "model.stiffness_ratio": "k",
  "model.mass_ratio": "m",
  "model.dissipation_ratio": "c",
  "load.horizontal.amplitude": "H^",
  "load.vertical": "V",
  "load.vertical.mean": "V",
  "load.force.amplitude": "F^",
};

/** A name such as theta_1, beta0, x_velocity or H^ as a symbol. @param {string} name @returns {Symbol_} */
export function symbolOf(name) {
  let base = name;
  let dots = 0;
  while (base.endsWith("_velocity")) {
    base = base.slice(0, -"_velocity".length);
    dots++;
  }
  const hat = base.endsWith("^");
  if (hat) base = base.slice(0, -1);
  const parts = /^([A-Za-z]+?)_?(\d+|(?<=_)[A-Za-z]+)?$/.exec(base);
  const stem = parts?.[1] ?? base;
  const letter = GREEK[stem] ?? stem;
  const single = [...letter].length === 1;
  if (!parts) return { text: base.replace(/_/g, " "), italic: false, sub: "", dots, hat };
  return { text: single ? letter : stem, italic: single, sub: parts[2] ?? "", dots, hat };
}

/** A parameter's symbol by its path, or null where it only has a name. @param {string} path @param {string} [given] */
export function parameterSymbol(path, given) {
  const name = given || OF_PATHS[path];
  return name ? symbolOf(name) : null;
}

/** Names of numbers that are called otherwise in words. @type {Record<string, string>} */
const IN_WORDS = { "impact.e": "restitution", "impact.r": "energy kept", "start.time": "time", "load.frequency": "frequency" };

const PARTS = ["contacts", "surfaces", "friction"];

/** A parameter's name in words. @param {string} path */
export function parameterName(path) {
  if (IN_WORDS[path]) return IN_WORDS[path];
  const parts = path.split(".");
  const own = parts.length > 3 && PARTS.includes(parts[1] ?? "") ? 2 : 1; // "stop position", without "contacts"
  const shown = parts.length > 2 || parts[0] === "load" ? parts.slice(own) : parts.slice(-1);
  return shown.join(" ").replace(/_/g, " ");
}

/** Whether a symbol alone says what a parameter is called: a letter, or the name of one. @param {string} path */
export function isLetter(path) {
  const name = (path.split(".").pop() ?? "").replace(/(_velocity)+$/, "");
  const symbol = symbolOf(name);
  return !IN_WORDS[path] && [...symbol.text].length === 1 && !symbol.hat;
}

/** The symbol as text for readouts and screen readers. @param {Symbol_} symbol */
export function asText(symbol) {
  const dotted = symbol.text + "\u0307".repeat(symbol.dots ? 1 : 0) + (symbol.hat ? "\u0302" : "");
  return symbol.sub ? dotted + subscript(symbol.sub) : dotted;
}

/** @param {string} digits */
function subscript(digits) {
  return /^\d+$/.test(digits) ? [...digits].map((d) => String.fromCharCode(0x2080 + Number(d))).join("") : `_${digits}`;
}

/** The symbol as an element: italics, a real subscript. @param {Symbol_} symbol */
export function asElement(symbol) {
  const whole = document.createElement("span");
  whole.className = "symbol";
  const base = document.createElement(symbol.italic ? "i" : "span");
  base.textContent = symbol.text;
  if (symbol.dots) base.className = "dotted";
  if (symbol.hat) base.className = "hatted";
  whole.append(base);
  if (symbol.sub) {
    const sub = document.createElement("sub");
    sub.textContent = symbol.sub;
    whole.append(sub);
  }
  return whole;
}

/**
 * @typedef {Pick<CanvasRenderingContext2D, "font"|"fillText"|"measureText"|"beginPath"|"arc"|"fill"|"moveTo"|"lineTo"|"stroke"
 *   |"lineWidth">} TextContext
 */

/**
 * An axis's name on a canvas, from the left: parts that are texts (upright) or symbols; returns its width. With `draw` false it
 * is only measured.
 * @param {TextContext} ctx @param {(string|Symbol_)[]} parts @param {number} x @param {number} y @param {number} size
 * @param {string} family @param {boolean} draw
 */
export function typeset(ctx, parts, x, y, size, family, draw = true) {
  const start = x;
  for (const part of parts) {
    const symbol = typeof part === "string" ? { text: part, italic: false, sub: "", dots: 0, hat: false } : part;
    ctx.font = `${symbol.italic ? "italic " : ""}${size}px ${family}`;
    const width = ctx.measureText(symbol.text).width;
    if (draw) {
      ctx.fillText(symbol.text, x, y);
      if (symbol.dots) dotsAbove(ctx, x + width / 2 + size * 0.06, y - heightOf(symbol.text, size), symbol.dots, size);
      if (symbol.hat) hatAbove(ctx, x + width / 2 + size * 0.08, y - heightOf(symbol.text, size), size);
    }
    x += width;
    if (symbol.sub) {
      ctx.font = `${size * 0.7}px ${family}`;
      if (draw) ctx.fillText(symbol.sub, x + size * 0.04, y + size * 0.22);
      x += ctx.measureText(symbol.sub).width + size * 0.06;
    }
  }
  return x - start;
}

/** How high a mark stands above a letter's baseline. @param {string} letter @param {number} size */
function heightOf(letter, size) {
  return size * (/^[acegmnopqrsuvwxyzαγεηικμνοπρστυχψω]/.test(letter) ? 0.62 : 0.86);
}

/** @param {TextContext} ctx @param {number} x @param {number} y @param {number} count @param {number} size */
function dotsAbove(ctx, x, y, count, size) {
  for (let i = 0; i < count; i++) {
    ctx.beginPath();
    ctx.arc(x + (i - (count - 1) / 2) * size * 0.24, y, size * 0.07, 0, 2 * Math.PI);
    ctx.fill();
  }
}

/** @param {TextContext} ctx @param {number} x @param {number} y @param {number} size */
function hatAbove(ctx, x, y, size) {
  ctx.lineWidth = size * 0.06;
  ctx.beginPath();
  ctx.moveTo(x - size * 0.17, y + size * 0.08);
  ctx.lineTo(x, y - size * 0.06);
  ctx.lineTo(x + size * 0.17, y + size * 0.08);
  ctx.stroke();
}
