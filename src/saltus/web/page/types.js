/**
 * The shapes of what passes between the parts of the page; no code. Python writes the description, `engine.js` gives the engine.
 *
 * @typedef {{path: string, symbol?: string, unit: string, value: number, low: number, high: number, step?: number,
 *   angle?: boolean, whole?: boolean, text?: string,
 *   range?: import("./checks.js").Range}} NumberEntry  One number of the system, by the path that Python uses.
 * @typedef {{channel: string, kind: string, parameters: NumberEntry[]}} LoadEntry
 * @typedef {{name: string, kind: string, meaning?: string}} MarginEntry  `kind`: "landmark", "assumption" or "limit".
 * @typedef {{name: string, velocity: string, unit: string, reach?: [number, number]}} CoordinateEntry
 *
 * @typedef {{coordinate: number, side: number, position: number, slopes: Record<string, number>, base: Record<string, number>}} Stop  A wall in a
 *   drawing: `side` is +1 to the right of the mass; the position changes with numbers by slopes from their base.
 *
 * @typedef {{name: string, weights: number[], tie: string}} StructurePoint  What is drawn of a structure: the weights of its coordinates
 *   in the point's displacement, and how it is tied to the one before.
 *
 * @typedef {object} Description
 * @property {number} version
 * @property {string} [title]
 * @property {{name: string, coordinates: CoordinateEntry[], parameters: NumberEntry[], contacts?: any[], frictions?: any[], stops?: Stop[], points?: StructurePoint[],
 *   margins?: MarginEntry[], text?: string}} model
 * @property {{name?: string, parameters: NumberEntry[]}} [impact]
 * @property {LoadEntry[]} load
 * @property {Record<string, number>} start
 * @property {{system: any, simulate: Record<string, any>}} study
 * @property {string} digest
 * @property {ResultEntry[]} [results]
 * @property {{name: string, values: Numbers, start: Numbers}[]} [presets]  What the author proposes to try.
 * @property {string[]} [without_effect]  Numbers that no equation of the model reads, and which have no slider.
 * @property {boolean} [embedded]  Whether the page is shown in a notebook, which it tells what is changed.
 *
 * @typedef {Record<string, number>} Numbers
 * @typedef {{time: number, kind: string, contact: string|number, before: ArrayLike<number>, after: ArrayLike<number>}} MotionEvent
 *
 * @typedef {{first: Record<string, number|null>, share: Numbers}} Validity
 *
 * @typedef {object} Motion
 * @property {{first: number, last: number}} time
 * @property {string} stop
 * @property {string} [limit]  The margin that has ended it.
 * @property {string} [reason]
 * @property {(t: number) => ArrayLike<number>} state  Coordinates, then velocities; at an impact those after it.
 * @property {(times: Float64Array) => Record<string, Float64Array>} sample
 * @property {MotionEvent[]} events
 * @property {(t: number) => number|null} [energy]
 * @property {(t: number) => Numbers|null} [margins]
 * @property {Validity|null} [validity]  Found when it is asked for; `checked` is it once it has been found.
 * @property {Validity|null} [checked]
 *
 * @typedef {{period: number|null, values?: Numbers}} EngineSystem
 * @typedef {{kind: string, points: number[][], radius?: number, role: string, text?: string}} Shape
 * @typedef {object} Engine
 * @property {(values: Numbers) => EngineSystem} system  Throws a refusal `{where, message}`.
 * @property {(system: EngineSystem, start: Numbers, duration: number, options?: {tolerance?: number, periods?: number}) => Motion} simulate
 * @property {(system: EngineSystem, state: ArrayLike<number>, time: number) => Shape[]|null} [drawing]
 * @property {(system: EngineSystem, channel: string, time: number) => number} [load]
 *
 * @typedef {{parameter: number[], amplitude: number[], stable: number[], period: number[], start: number[][],
 *   time?: number[], multipliers?: number[][][], evidence?: string[]}} ResultBranch  `start`: state variables of each orbit.
 * @typedef {{kind: string, parameter: number, amplitude: number, text: string}} SpecialPoint
 * @typedef {object} ResultEntry  A result of Python, as `results.py` writes it.
 * @property {string} kind  "diagram", "chart", "basins" or "curves"
 * @property {string} title
 * @property {string} digest
 * @property {Numbers} [values]  All numbers of the system of which it is.
 * @property {string} [path]
 * @property {string} [quantity]
 * @property {[number, number]} [bounds]  The range of the study, beyond which loops may go on.
 * @property {ResultBranch[]} [branches]
 * @property {SpecialPoint[]} [special]
 * @property {{parameter: number[], amplitude: number[]}} [dots]
 * @property {{low: number, high: number}[]} [bands]
 * @property {string[]} [paths]
 * @property {string[]} [plane]
 * @property {Numbers} [fixed]
 * @property {number[]} [x]
 * @property {number[]} [y]
 * @property {(number|null)[][]} [cells]  Rows along x.
 * @property {(number[]|null)[][]} [starts]  The state to start from in each cell.
 * @property {{label: number, name: string, section?: number[]}[]} [attractors]
 * @property {{name: string, stable: boolean, points: number[][]}[]} [curves]
 *
 * @typedef {object} State  All that the page remembers; a link holds it.
 * @property {Numbers} values
 * @property {Numbers} start
 * @property {number} periods  How long the motion lasts, in forcing periods, or in units of time where there is no period.
 * @property {number} cursor  The time that is shown.
 * @property {number|null} hover  The time under the pointer.
 * @property {boolean} playing
 * @property {number} speed  Units of time per second.
 * @property {number} coordinate  Which coordinate the views show.
 * @property {boolean} degrees
 * @property {"light"|"dark"|"system"} theme
 * @property {Record<string, number[]|null>} windows  The part of each view that is seen; null is all.
 * @property {Record<string, [number, number]>} ranges  The ranges of sliders that were changed.
 * @property {{path: string, low: number, high: number, count: number, periods: number}} sweep
 * @property {{result: number, branch: number, point: number}|null} selected
 */
export {};
