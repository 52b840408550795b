// SPDX-License-Identifier: BSD-3-Clause
// Curves over time with the band of good runs, marks, alarms, departures, and the position.

import {cssColor} from './css_color.js';
import {clock} from './transport.js';

const HEAD = 34;
const LANE = 46;
const FOOT = 20;
const LEFT = 150;

/** Draws the timeline of a run; a click or drag seeks. */
export class Timeline {
  /** @param {HTMLElement} box  @param {(time: number) => void} onSeek */
  constructor(box, onSeek) {
    this.box = box;
    this.onSeek = onSeek;
    this.canvas = document.createElement('canvas');
    this.picture = document.createElement('canvas');
    box.append(this.canvas);
    this.begin = 0;
    this.end = 1;
    this.lanes = [];
    this.isStale = true;
    /** @type {(time: number, step: number) => string} */
    this.tickText = (time, step) => step >= 1 ? clock(time).slice(0, -3) : clock(time);
    this.listen();
  }

  /** @param {any} run  @param {import('./packed.js').Columns} columns */
  show(run, columns) {
    this.run = run;
    this.begin = this.from = run.begin;
    this.end = this.to = Math.max(run.end, run.begin + 0.01);
    this.lanes = run.lanes.map((/** @type {any} */ it) => ({...it,
      low: columns.of(it.low), high: columns.of(it.high),
      band: it.band ? {low: columns.of(it.band.low), high: columns.of(it.band.high),
        out: columns.of(it.band.out)} : null}));
    this.isStale = true;
  }

  /**
   * Keeps the curves with these labels, in this order; without labels, departed ones come first.
   * @param {string[]} labels  @param {number} height  in pixels, for all of them
   */
  keep(labels, height) {
    const most = Math.max(Math.floor((height - HEAD - FOOT) / LANE), 0);
    const named = labels.flatMap((label) => this.lanes.filter(
      (it) => it.label === label || `${it.device} ${it.label}` === label));
    const rank = (/** @type {any} */ it) => (it.band?.out.some(Boolean) ? 0 : 1);
    this.lanes = (labels.length > 0 ? named
      : [...this.lanes].sort((one, other) => rank(one) - rank(other))).slice(0, most);
    this.isStale = true;
  }

  get height() {
    return HEAD + LANE * Math.max(this.lanes.length, 0) + FOOT;
  }

  get left() {
    return this.width < 600 ? 8 : LEFT;
  }

  resize() {
    this.width = this.box.clientWidth;
    const ratio = window.devicePixelRatio;
    for (const it of [this.canvas, this.picture]) {
      it.width = Math.round(this.width * ratio);
      it.height = Math.round(this.height * ratio);
    }
    this.canvas.style.height = `${this.height}px`;
    this.isStale = true;
  }

  /** @param {number} time */
  x(time) {
    return this.left + (time - this.begin) / (this.end - this.begin)
      * (this.width - this.left - 10);
  }

  /** @param {number} x */
  timeAt(x) {
    return this.begin + (x - this.left) / (this.width - this.left - 10)
      * (this.end - this.begin);
  }

  listen() {
    let isDown = false;
    const seek = (/** @type {PointerEvent} */ event) => {
      this.onSeek(this.timeAt(event.clientX - this.canvas.getBoundingClientRect().left));
    };
    this.canvas.addEventListener('pointerdown', (event) => {
      isDown = true;
      this.canvas.setPointerCapture(event.pointerId);
      seek(event);
    });
    this.canvas.addEventListener('pointermove', (event) => {
      if (isDown) seek(event);
    });
    for (const name of ['pointerup', 'pointercancel']) {
      this.canvas.addEventListener(name, () => { isDown = false; });
    }
    this.canvas.addEventListener('wheel', (event) => {
      if (!event.ctrlKey) return;  // a plain wheel scrolls the page
      event.preventDefault();
      const x = event.clientX - this.canvas.getBoundingClientRect().left;
      this.zoom(event.deltaY < 0 ? 1 : -1, this.timeAt(x));
    }, {passive: false});
  }

  /** @param {number} steps  above 0: in; below 0: out  @param {number} around */
  zoom(steps, around) {
    const factor = 0.7 ** steps;
    const whole = this.to - this.from;
    const span = Math.min(Math.max((this.end - this.begin) * factor, 0.2), whole);
    const share = (around - this.begin) / (this.end - this.begin);
    this.begin = Math.min(Math.max(around - share * span, this.from), this.to - span);
    this.end = this.begin + span;
    this.isStale = true;
    this.onSeek(NaN);
  }

  /** @param {import('./transport.js').Transport} transport */
  draw(transport) {
    if (this.isStale) this.paint();
    const context = /** @type {CanvasRenderingContext2D} */ (this.canvas.getContext('2d'));
    const ratio = this.canvas.width / Math.max(this.width, 1);
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, this.canvas.width, this.canvas.height);
    context.drawImage(this.picture, 0, 0);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    if (transport.isLooping) {
      context.fillStyle = this.color('--loop');
      const [first, last] = [this.x(transport.loopBegin), this.x(transport.loopEnd)];
      context.globalAlpha = 0.9;
      context.fillRect(first, HEAD - 4, Math.max(last - first, 2), 4);
      context.globalAlpha = 1;
    }
    const x = this.x(transport.time);
    context.strokeStyle = context.fillStyle = this.color('--text');
    context.lineWidth = 1.5;
    context.beginPath();
    context.moveTo(x, HEAD - 8);
    context.lineTo(x, this.height - FOOT);
    context.stroke();
    context.beginPath();
    context.moveTo(x - 6, HEAD - 14);
    context.lineTo(x + 6, HEAD - 14);
    context.lineTo(x, HEAD - 5);
    context.fill();
  }

  /** @param {string} name */
  color(name) {
    return getComputedStyle(this.box).getPropertyValue(name);
  }

  /** Paints everything that does not move. */
  paint() {
    this.isStale = false;
    const context = /** @type {CanvasRenderingContext2D} */ (this.picture.getContext('2d'));
    const ratio = this.picture.width / Math.max(this.width, 1);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, this.width, this.height);
    context.font = '12px system-ui, sans-serif';
    this.paintTicks(context);
    this.lanes.forEach((lane, row) => this.paintLane(context, lane, HEAD + row * LANE));
    this.paintMoments(context);
  }

  /** @param {CanvasRenderingContext2D} context */
  paintTicks(context) {
    const span = this.end - this.begin;
    const most = Math.max((this.width - this.left) / 70, 2);
    const step = [0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600]
      .find((it) => span / it <= most) ?? 1800;
    context.textAlign = 'center';
    for (let n = Math.ceil(this.begin / step); n * step <= this.end; ++n) {
      const x = this.x(n * step);
      context.fillStyle = this.color('--grid');
      context.fillRect(x, HEAD, 1, this.height - HEAD - FOOT);
      context.fillStyle = this.color('--quiet');
      const words = this.tickText(n * step, step);
      const half = 0.5 * context.measureText(words).width;
      context.fillText(words, Math.min(Math.max(x, half + 2), this.width - half - 2),
        this.height - 6);
    }
  }

  /** @param {CanvasRenderingContext2D} context  @param {any} lane  @param {number} top */
  paintLane(context, lane, top) {
    const [low, high] = lane.scale;
    const y = (/** @type {number} */ value) => top + LANE - 4
      - (value - low) / (high - low || 1) * (LANE - 10);
    const x = (/** @type {number} */ column) => this.x(lane.begin + column * lane.step);
    context.fillStyle = this.color('--line');
    context.fillRect(0, top + LANE - 1, this.width, 1);
    context.save();
    context.beginPath();
    context.rect(this.left, top, this.width - this.left - 10, LANE);
    context.clip();
    const first = Math.max(Math.floor((this.begin - lane.begin) / lane.step) - 1, 0);
    const last = Math.min(Math.ceil((this.end - lane.begin) / lane.step) + 1, lane.low.length);
    if (lane.band !== null) this.paintBand(context, lane, first, last, x, y);
    context.strokeStyle = this.color('--bad');
    context.setLineDash([4, 4]);
    for (const limit of lane.limits) {
      context.beginPath();
      context.moveTo(this.left, y(limit));
      context.lineTo(this.width, y(limit));
      context.stroke();
    }
    context.setLineDash([]);
    strokeCurve(context, lane, first, last, x, y, () => true, cssColor(lane.color), 1.6);
    if (lane.band !== null) {
      strokeCurve(context, lane, first, last, x, y, (/** @type {number} */ it) =>
        lane.band.out[it] !== 0, this.color('--bad'), 3);
    }
    context.restore();
    this.paintNames(context, lane, top, y);
  }

  /** Paints the band of good runs.
   *  @param {any} context @param {any} lane @param {number} first @param {number} last
   *  @param {any} x @param {any} y */
  paintBand(context, lane, first, last, x, y) {
    context.fillStyle = this.color('--band');
    for (let begin = first; begin < last;) {
      if (Number.isNaN(lane.band.low[begin])) { ++begin; continue; }
      let end = begin;
      while (end < last && !Number.isNaN(lane.band.low[end])) ++end;
      context.beginPath();
      for (let i = begin; i < end; ++i) context.lineTo(x(i + 0.5), y(lane.band.high[i]));
      for (let i = end - 1; i >= begin; --i) context.lineTo(x(i + 0.5), y(lane.band.low[i]));
      context.fill();
      begin = end;
    }
  }

  /** @param {CanvasRenderingContext2D} context @param {any} lane @param {number} top
   *  @param {(value: number) => number} y */
  paintNames(context, lane, top, y) {
    context.textAlign = 'left';
    const isNarrow = this.left < LEFT;
    context.fillStyle = cssColor(lane.color);
    context.fillRect(isNarrow ? this.left : 4, top + 6, 3, isNarrow ? 12 : LANE - 14);
    context.fillStyle = this.color('--text');
    if (isNarrow) {
      const room = this.width - this.left - 18;
      const name = ` ${named(context, lane,
        Math.max(room - context.measureText(`${lane.device} `).width, 0.6 * room))}`;
      context.fillText(fitted(context, lane.device,
        room - context.measureText(name).width) + name, this.left + 8, top + 16);
      return;
    }
    context.fillText(named(context, lane, this.left - 50), 12, top + 17);
    context.fillStyle = this.color('--quiet');
    context.fillText(fitted(context, lane.device, this.left - 50), 12, top + 33);
    context.textAlign = 'right';
    for (const [value, text] of lane.ticks) {
      context.fillText(text, this.left - 6, Math.min(Math.max(y(value) + 4, top + 12),
        top + LANE - 4));
    }
  }

  /** @param {CanvasRenderingContext2D} context */
  paintMoments(context) {
    const {alarms, moments, departures} = this.run;
    context.fillStyle = this.color('--bad');
    for (const it of alarms) {
      const x = this.x(it.begin);
      context.fillRect(Math.max(x, this.left), HEAD - 3, Math.max(this.x(it.end) - x, 2), 3);
    }
    let free = -Infinity;
    context.textAlign = 'left';
    for (const it of moments) {
      const x = this.x(it.at);
      if (x < this.left || x > this.width - 4) continue;
      context.fillStyle = this.color('--quiet');
      context.fillRect(x, HEAD - 10, 1, this.height - HEAD - FOOT + 10);
      const width = context.measureText(it.label).width;
      if (x + 4 < free || x + width + 4 > this.width) continue;
      context.fillText(it.label, x + 4, 12);
      free = x + width + 14;
    }
    let beside = -Infinity;  // those that began at one time stand beside each other
    departures.forEach((/** @type {any} */ it, /** @type {number} */ row) => {
      const x = this.x(it.began_s);
      if (x < this.left || x > this.width) return;
      const at = Math.abs(x - beside) < 15 || x < beside ? beside + 15 : x;
      if (at > this.width - 8) return;
      beside = at;
      const lane = this.lanes.findIndex((that) => that.device === it.device
        && that.label === it.label);
      context.fillStyle = this.color('--bad');
      context.beginPath();
      context.arc(at, HEAD - 16, 7, 0, 2 * Math.PI);
      context.fill();
      context.fillRect(x - 0.5, HEAD - 9, 1, 9);
      if (lane >= 0) context.fillRect(x - 1, HEAD + lane * LANE, 2, LANE - 1);
      context.fillStyle = this.color('--paper');
      context.textAlign = 'center';
      context.font = 'bold 10px system-ui, sans-serif';
      context.fillText(String(row + 1), at, HEAD - 12.5);
      context.font = '12px system-ui, sans-serif';
      context.textAlign = 'left';
    });
  }
}

/** @param {CanvasRenderingContext2D} context @param {any} lane @param {number} first
 *  @param {number} last @param {any} x @param {any} y @param {(column: number) => boolean} isDrawn
 *  @param {string} color @param {number} width */
function strokeCurve(context, lane, first, last, x, y, isDrawn, color, width) {
  context.strokeStyle = color;
  context.lineWidth = width;
  context.lineJoin = 'round';
  context.beginPath();
  let isOpen = false;
  let before = -Infinity;
  for (let i = first; i < last; ++i) {
    const low = lane.low[i];
    if (Number.isNaN(low)) {
      if (i - before > 0.5 / lane.step) isOpen = false;  // rare values are joined
      continue;
    }
    before = i;
    if (!isDrawn(i)) { isOpen = false; continue; }
    const at = x(i + 0.5);
    if (isOpen) context.lineTo(at, y(low));
    else context.moveTo(at, y(low));
    if (lane.high[i] !== low) context.lineTo(at, y(lane.high[i]));
    else if (!isOpen) context.lineTo(at + 0.5, y(low));
    isOpen = true;
  }
  context.stroke();
}

/** The name of a curve with its unit, which a long name does not push out.
 *  @param {CanvasRenderingContext2D} context @param {any} lane @param {number} width */
function named(context, lane, width) {
  const unit = lane.unit ? ` [${lane.unit}]` : '';
  const room = Math.max(width - context.measureText(unit).width, 0.5 * width);
  return fitted(context, fitted(context, lane.label, room) + unit, width);
}

/** @param {CanvasRenderingContext2D} context @param {string} text @param {number} width */
function fitted(context, text, width) {
  const whole = context.measureText(text).width;
  if (whole <= width) return text;
  const letters = [...text];
  let count = Math.min(letters.length, Math.ceil(2 * letters.length * Math.max(width, 0) / whole));
  const cut = () => `${letters.slice(0, count).join('')}…`;
  while (count > 1 && context.measureText(cut()).width > width) --count;
  return cut();
}
