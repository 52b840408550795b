// SPDX-License-Identifier: BSD-3-Clause
// The numbers at a moment. Held values have texts from Python; velocities are interpolated.

import {between, rowAt} from './tracks.js';

/** @typedef {{text: string, value: number|null, color: number[]}} Shown */

const STALE = [0.55, 0.55, 0.55];  // as in RViz

/** A number over the time of a run. */
export class NumberTrack {
  /** @param {any} entry  @param {import('./packed.js').Columns} columns */
  constructor(entry, columns) {
    this.device = entry.device;
    this.label = entry.label;
    this.quantity = entry.quantity;
    this.color = entry.color;
    this.times = columns.of(entry.times);
    this.format = entry.format;
    this.vectors = entry.vectors ? columns.of(entry.vectors) : null;
    this.values = entry.values ? columns.of(entry.values) : null;
    this.texts = entry.texts;
    this.short = entry.short;
    this.holds = entry.holds ?? Infinity;
    this.text = entry.text ? columns.of(entry.text) : null;
    this.colors = entry.colors;
    this.colored = entry.colored ? columns.of(entry.colored) : null;
  }

  /** @param {number} time  @returns {Shown} */
  at(time) {
    return this.vectors === null ? this.held(time) : this.speed(time);
  }

  /** @param {number} time  @returns {Shown} */
  held(time) {
    const row = rowAt(this.times, time);
    if (row < 0 || this.values === null || this.text === null) {
      return {text: `${this.label} –`, value: null, color: this.color};
    }
    const age = time - this.times[row];
    if (age > this.holds) {
      return {text: `${this.short} no data for ${age.toFixed(1)} s`.trim(), value: null, color: STALE};
    }
    const color = this.colored === null ? this.color : this.colors[this.colored[row]];
    return {text: this.texts[this.text[row]], value: this.values[row], color};
  }

  /** @param {number} time  @returns {Shown} */
  speed(time) {
    const vector = [0, 0, 0];
    const {label, unit, decimals} = this.format;
    if (this.vectors === null || !between(this.times, this.vectors, time, vector)) {
      return {text: `${label} –`, value: null, color: this.color};
    }
    const value = Math.hypot(...vector);
    return {text: `${label} ${value.toFixed(decimals)} ${unit}`, value, color: this.color};
  }
}
