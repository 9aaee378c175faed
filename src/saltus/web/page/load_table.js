/** The load between its breakpoints: what Python's `record_table` makes of pulses and records, from the numbers of the page. */

/**
 * @typedef {object} Records  Of the description's `engine.records`.
 * @property {({pulse: number, order: number} | {breaks: number[], table: number[][]})[]} rows
 * @property {number} pulses @property {number} most @property {number} width
 * @property {number} since @property {number} within @property {number} after
 */

/**
 * The breakpoints of a load, and the polynomials of each row between them.
 * @param {Records} layout @param {Float64Array} edges when each pulse begins and ends, and its length
 * @returns {[Float64Array, Float64Array]}
 */
export function loadTable(layout, edges) {
  const { rows, width } = layout;
  const times = edges.filter((_, i) => i % 3 < 2);
  const breaks = Float64Array.from(new Set([...times, ...rows.flatMap((row) => ("breaks" in row ? row.breaks : []))])).sort();
  const size = (breaks.length + 1) * width;
  const table = new Float64Array(rows.length * size);
  rows.forEach((row, i) => {
    const own = table.subarray(i * size, (i + 1) * size);
    if ("breaks" in row) fillRecord(own, breaks, row, width);
    else fillClock(own, breaks, edges.subarray(3 * row.pulse, 3 * row.pulse + 3), row.order, layout);
  });
  return [breaks, table];
}

/**
 * A row of a pulse: its time since the start, whether it acts, or the time since its end, in each piece.
 * @param {Float64Array} row @param {Float64Array} breaks @param {Float64Array} times its start, its end and its length @param {number} order
 * @param {Records} layout
 */
function fillClock(row, breaks, times, order, layout) {
  const [start = 0, end = 0, length = 0] = times;
  const { width, since, within, after } = layout;
  breaks.forEach((at, i) => {
    const piece = (i + 1) * width;
    const acts = at >= start && at < end ? 1 : 0;
    const past = at >= end ? 1 : 0;
    if (order === since) row[piece] = past ? length : acts ? at - start : 0;
    if (order === after) row[piece] = past ? at - end : 0;
    if (order === since) row[piece + 1] = acts;
    else if (order === after) row[piece + 1] = past;
    else if (order === within) row[piece] = acts;
    else if (order === after + 1) row[piece] = past;
  });
}

/**
 * A row of a record: its own polynomials, counted from the load's breakpoints.
 * @param {Float64Array} row @param {Float64Array} breaks @param {{breaks: number[], table: number[][]}} record @param {number} width
 */
function fillRecord(row, breaks, record, width) {
  for (let i = 0; i <= breaks.length; i++) {
    const anchor = breaks[Math.max(i - 1, 0)];
    const piece = i === 0 ? 0 : placeAbove(record.breaks, anchor);
    const shift = anchor - record.breaks[Math.max(piece - 1, 0)];
    const own = Float64Array.from(record.table[piece]);
    for (let k = 0; k < width - 1; k++) for (let j = width - 2; j >= k; j--) own[j] += shift * own[j + 1];
    row.set(own, i * width);
  }
}

/**
 * The piece of a load at a time: of breakpoints that are times or, with a forcing period, shares of it.
 * @param {ArrayLike<number>} breaks @param {number} period 0 for times @param {number} time @param {number} local the time within its period
 */
export function pieceAt(breaks, period, time, local) {
  return period ? placeAbove(Array.from(breaks, (share) => share * period), local) : placeAbove(breaks, time);
}

/** The place of the first of sorted numbers that is larger than a value. @param {ArrayLike<number>} sorted @param {number} value */
export function placeAbove(sorted, value) {
  let low = 0;
  let high = sorted.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (sorted[middle] <= value) low = middle + 1;
    else high = middle;
  }
  return low;
}
