// SPDX-License-Identifier: BSD-3-Clause
// Values at a moment: those of the newest row, as in RViz, or interpolated between two rows.

const TURN_STEPS = 32767;

/**
 * Returns the last row at or before a time; -1 before the first.
 * @param {ArrayLike<number>} times  rising
 * @param {number} time
 */
export function rowAt(times, time) {
  let low = 0;
  let high = times.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle] <= time) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

/**
 * Writes the numbers at a time, interpolated linearly between two rows.
 * @param {ArrayLike<number>} times
 * @param {ArrayLike<number>} rows  each with as many numbers as `found`
 * @param {number} time
 * @param {number[]} found
 * @returns {boolean} false outside the rows, and where a number is missing (NaN)
 */
export function between(times, rows, time, found) {
  const row = rowAt(times, time);
  const width = found.length;
  if (row < 0 || (row === times.length - 1 && time > times[row])) return false;
  const next = Math.min(row + 1, times.length - 1);
  const span = times[next] - times[row];
  const share = span > 0 ? (time - times[row]) / span : 0;
  for (let i = 0; i < width; ++i) {
    const first = rows[row * width + i];
    found[i] = share === 0 ? first : first + share * (rows[next * width + i] - first);
    if (Number.isNaN(found[i])) return false;
  }
  return true;
}

/**
 * Writes the numbers of the last row at or before a time.
 * @param {ArrayLike<number>} times
 * @param {ArrayLike<number>} rows  each with as many numbers as `found`
 * @param {number} time
 * @param {number[]} found
 * @returns {boolean} false before the first row, and where a number is missing (NaN)
 */
export function held(times, rows, time, found) {
  const row = rowAt(times, time);
  if (row < 0) return false;
  for (let i = 0; i < found.length; ++i) found[i] = rows[row * found.length + i];
  return !found.some(Number.isNaN);
}

/**
 * A place, fixed or moving: each row holds until the next one, or rows are interpolated.
 * @typedef {{at: number[]}|{times: ArrayLike<number>, positions: ArrayLike<number>,
 *   turns: ArrayLike<number>, between?: boolean}} Place
 */

/**
 * Writes the pose of a place at a time: position and quaternion x y z w.
 * @param {any} place
 * @param {number} time
 * @param {number[]} found  seven numbers
 */
export function placeAt(place, time, found) {
  if (place.at) {
    for (let i = 0; i < 7; ++i) found[i] = place.at[i];
    return;
  }
  const {times, positions, turns} = place;
  const row = Math.max(rowAt(times, time), 0);
  const next = Math.min(row + 1, times.length - 1);
  const span = times[next] - times[row];
  const share = place.between && span > 0
    ? Math.min(Math.max((time - times[row]) / span, 0), 1) : 0;
  for (let i = 0; i < 3; ++i) {
    const first = positions[3 * row + i];
    found[i] = first + share * (positions[3 * next + i] - first);
  }
  let square = 0;
  for (let i = 0; i < 4; ++i) {
    const first = turns[4 * row + i] / TURN_STEPS;
    const turn = first + share * (turns[4 * next + i] / TURN_STEPS - first);
    found[3 + i] = turn;
    square += turn * turn;
  }
  const length = Math.sqrt(square) || 1;
  for (let i = 3; i < 7; ++i) found[i] /= length;
}

/**
 * Returns whether a time is in one of the spans.
 * @param {number[][]} spans  start and end of each
 * @param {number} time
 */
export function isWithin(spans, time) {
  return spans.some(([begin, end]) => begin <= time && time <= end);
}
