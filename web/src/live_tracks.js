// SPDX-License-Identifier: BSD-3-Clause
// The data of a running cell, as rows over time: see page/live_scene.py and page/live_lanes.py.

import {rowAt} from './tracks.js';

const FRAME = 1;
const LANES = 2;
const CLOUD = 3;
const HEAD_BYTES = 16;
const KEPT_S = 300;
const KEPT_COLUMNS_S = 600;

/** @typedef {{times: number[], [column: string]: any[]}} Rows  all columns grow together */

/** The number of values in each row of a column. */
const WIDTHS = {positions: 3, turns: 4, vectors: 3, feet: 3, colors: 3, texts: 1};

/** @returns {Rows} */
const placeRows = () => ({times: [], positions: [], turns: []});
/** @returns {Rows} */
const arrowRows = () => ({times: [], vectors: [], feet: [], colors: []});
/** @returns {Rows} */
const textRows = () => ({times: [], texts: [], colors: []});

/** The rows of all places, arrows and texts so far. */
export class LiveTracks {
  constructor() {
    /** @type {Map<string, Rows>} */
    this.rows = new Map();
    this.layout = null;
    this.targets = {places: [], arrows: [], texts: []};
    this.begin = NaN;
    this.end = NaN;
  }

  /** @param {any} layout  of the following frames */
  arrange(layout) {
    this.layout = layout;
    this.targets = {
      places: layout.places.filter((/** @type {any} */ it) => !it.at).map(
        (/** @type {any} */ it) => this.rowsOf(`place ${it.name}`, placeRows)),
      arrows: layout.arrows.map((/** @type {any} */ it) => this.rowsOf(arrowKey(it), arrowRows)),
      texts: layout.texts.map((/** @type {any} */ it) => this.rowsOf(textKey(it), textRows)),
    };
  }

  /** @param {string} key  @param {() => Rows} make */
  rowsOf(key, make) {
    let found = this.rows.get(key);
    if (found === undefined) {
      found = make();
      this.rows.set(key, found);
    }
    return found;
  }

  /**
   * Adds the rows of a frame.
   * @param {DataView} view
   * @returns {number|null} its time; null if it has another layout or is not newer
   */
  take(view) {
    if (this.layout === null || view.getUint16(2, true) !== this.layout.number) return null;
    const time = view.getFloat64(8, true);
    if (time <= this.end) return null;
    const {places, arrows, texts} = this.targets;
    let at = HEAD_BYTES;
    for (const rows of places) {
      rows.times.push(time);
      for (let i = 0; i < 3; ++i, at += 4) rows.positions.push(view.getFloat32(at, true));
      for (let i = 0; i < 4; ++i, at += 2) rows.turns.push(view.getInt16(at, true));
    }
    for (const rows of arrows) {
      rows.times.push(time);
      for (const column of [rows.feet, rows.vectors]) {
        for (let i = 0; i < 3; ++i, at += 4) column.push(view.getFloat32(at, true));
      }
      at = color(view, at, rows.colors);
    }
    for (const rows of texts) {
      rows.times.push(time);
      at = color(view, at, rows.colors);
      const count = view.getUint8(at);
      const text = decoder.decode(new Uint8Array(view.buffer, view.byteOffset + at + 1, count));
      const before = rows.texts.at(-1);
      rows.texts.push(text === before ? before : text);  // rows with equal texts share one
      at += 1 + count;
    }
    if (Number.isNaN(this.begin)) this.begin = time;
    this.end = time;
    return time;
  }

  /** Adds the rows of earlier frames where rows are missing.  @param {DataView[]} frames */
  insert(frames) {
    const found = new LiveTracks();
    found.arrange(this.layout);
    for (const it of frames) found.take(it);
    if (Number.isNaN(found.begin)) return;
    for (const [key, rows] of found.rows) {
      const own = /** @type {Rows} */ (this.rows.get(key));
      const row = rowAt(own.times, found.begin) + 1;
      if (row < own.times.length && own.times[row] <= found.end) continue;
      for (const [name, column] of Object.entries(rows)) {
        const width = WIDTHS[name] ?? 1;
        own[name].splice(row * width, 0, ...column);
      }
    }
    this.begin = Math.min(this.begin, found.begin);
  }

  /** Drops rows older than KEPT_S. */
  trim() {
    const oldest = this.end - KEPT_S;
    if (!(this.begin < oldest)) return;
    for (const rows of this.rows.values()) {
      const count = rowAt(rows.times, oldest);
      if (count <= 0) continue;
      for (const [name, column] of Object.entries(rows)) {
        column.splice(0, count * (WIDTHS[name] ?? 1));
      }
    }
    this.begin = oldest;
  }
}

const decoder = new TextDecoder();

/** @param {DataView} view  @param {number} at  @param {number[]} column */
function color(view, at, column) {
  for (let i = 0; i < 3; ++i) column.push(view.getUint8(at + i) / 255);
  return at + 3;
}

/** @param {any} it */
export function arrowKey(it) {
  return `arrow ${it.device} ${it.variable} ${it.quantity}`;
}

/** @param {any} it */
export function textKey(it) {
  return `text ${it.device} ${it.quantity} ${it.label}`;
}

/** A number or a note over time, with the texts of the cell's nodes. */
export class LiveNumber {
  /** @param {any} entry  @param {Rows} rows */
  constructor(entry, rows) {
    Object.assign(this, entry);
    this.device = entry.device;
    this.label = entry.label;
    this.quantity = entry.quantity;
    this.times = rows.times;
    this.rows = rows;
  }

  /** @param {number} time */
  at(time) {
    const row = rowAt(this.times, time);
    const text = row < 0 ? '' : this.rows.texts[row];
    const color = row < 0 ? [0.5, 0.5, 0.5] : this.rows.colors.slice(3 * row, 3 * row + 3);
    const isNote = this.quantity === 'note';
    return {text: text || (isNote ? '' : `${this.label} –`), value: null, color};
  }
}

/** The columns of the curves. */
export class LiveColumns {
  constructor() {
    this.reset(-1, 0, 0, 0);
  }

  /** @param {number} set  @param {number} count  @param {number} first  @param {number} epoch */
  reset(set, count, first, epoch) {
    this.set = set;
    this.first = first;
    this.epoch = epoch;
    this.lanes = Array.from({length: count}, () => ({hasBand: false,
      low: /** @type {number[]} */ ([]), high: /** @type {number[]} */ ([]),
      band: {low: /** @type {number[]} */ ([]), high: /** @type {number[]} */ ([]),
        out: /** @type {number[]} */ ([])}}));
  }

  get length() {
    return this.lanes.length > 0 ? this.lanes[0].low.length : 0;
  }

  /**
   * Takes columns, which replace existing ones.
   * @param {DataView} view
   * @returns {boolean} whether earlier columns are missing
   */
  take(view) {
    const [count, set] = [view.getUint8(1), view.getUint16(2, true)];
    const [first, n, epoch] = [view.getUint32(4, true), view.getUint32(8, true),
      view.getFloat64(12, true)];
    const isOther = set !== this.set || epoch !== this.epoch || count !== this.lanes.length;
    const isGap = !isOther && first > this.first + this.length;
    const isEarlier = !isOther && first < this.first;
    if (isOther || isGap || isEarlier) this.reset(set, count, first, epoch);
    let at = 20 + count;
    this.lanes.forEach((lane, row) => {
      const isBanded = view.getUint8(20 + row) !== 0;
      lane.hasBand ||= isBanded;
      for (const column of columnsOf(lane)) column.length = first - this.first;  // sent again
      for (const column of [lane.low, lane.high, lane.band.low, lane.band.high]) {
        const isSent = isBanded || column === lane.low || column === lane.high;
        for (let i = 0; i < n; ++i) column.push(isSent ? view.getFloat32(at + 4 * i, true) : NaN);
        if (isSent) at += 4 * n;
      }
      for (let i = 0; i < n; ++i) lane.band.out.push(isBanded ? view.getUint8(at + i) : 0);
      if (isBanded) at += n;
    });
    return (isOther || isGap) && first > 0;
  }

  /** @param {number} step */
  trim(step) {
    const count = this.length - Math.round(KEPT_COLUMNS_S / step);
    if (count < 100) return;
    for (const lane of this.lanes) {
      for (const column of columnsOf(lane)) column.splice(0, count);
    }
    this.first += count;
  }
}

/** @param {any} lane  @returns {number[][]} all its columns, which grow together */
function columnsOf({low, high, band}) {
  return [low, high, band.low, band.high, band.out];
}

const CLOUD_HEAD_BYTES = 40;
const KEPT_CLOUDS = 150;

/** The received clouds, each with its time. */
export class LiveClouds {
  constructor() {
    /** @type {number[]} */
    this.times = [];
    /** @type {{positions: Float32Array, colors: Uint8Array}[]} */
    this.clouds = [];
  }

  /** @param {DataView} view */
  take(view) {
    const count = view.getUint32(4, true);
    const numbers = Array.from({length: 6}, (_, i) => view.getFloat32(16 + 4 * i, true));
    const steps = new Uint16Array(view.buffer, view.byteOffset + CLOUD_HEAD_BYTES, 3 * count);
    const positions = new Float32Array(3 * count);
    for (let i = 0; i < positions.length; ++i) {
      positions[i] = numbers[i % 3] + steps[i] / 65535 * numbers[3 + i % 3];
    }
    this.times.push(view.getFloat64(8, true));
    this.clouds.push({positions, colors: new Uint8Array(view.buffer,
      view.byteOffset + CLOUD_HEAD_BYTES + 6 * count, 3 * count)});
    if (this.times.length > KEPT_CLOUDS) {
      this.times.shift();
      this.clouds.shift();
    }
  }
}

/** The received unmodeled objects; each row holds until the next one. */
export class LiveObjects {
  constructor() {
    /** @type {number[]} */
    this.times = [];
    /** @type {any[][]} */
    this.rows = [];
  }

  /** @param {{time: number, objects: any[]}} message */
  take({time, objects}) {
    this.times.push(time);
    this.rows.push(objects);
  }

  /** Drops rows that ended before a time.  @param {number} begin */
  trim(begin) {
    const count = rowAt(this.times, begin);
    if (count <= 0) return;
    this.times.splice(0, count);
    this.rows.splice(0, count);
  }
}

/** @param {ArrayBuffer} buffer  @returns {DataView[]} the messages in it, each after its length */
export function messagesIn(buffer) {
  const found = [];
  const whole = new DataView(buffer);
  for (let at = 0; at + 4 <= buffer.byteLength;) {
    const length = whole.getUint32(at, true);
    found.push(new DataView(buffer, at + 4, length));
    at += 4 + length;
  }
  return found;
}

/** @param {DataView} view */
export function isFrame(view) {
  return view.getUint8(0) === FRAME;
}

/** @param {DataView} view */
export function isLanes(view) {
  return view.getUint8(0) === LANES;
}

/** @param {DataView} view */
export function isCloud(view) {
  return view.getUint8(0) === CLOUD;
}
