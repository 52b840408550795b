// SPDX-License-Identifier: BSD-3-Clause

/**
 * Returns a color in CSS notation.
 * @param {number[]} color  red green blue from 0 to 1
 */
export function cssColor(color) {
  return `rgb(${color.slice(0, 3).map((it) => Math.round(255 * it)).join(' ')})`;
}
