// SPDX-License-Identifier: BSD-3-Clause
// The shown moment: playback in either direction, at several rates, in a loop.

export const RATES = [0.1, 0.25, 0.5, 1, 1.5, 2, 4];

/** The position in a recording; it has no clock of its own. */
export class Transport {
  /** @param {number} begin  @param {number} end  in s */
  constructor(begin, end) {
    this.begin = begin;
    this.end = end;
    this.time = begin;
    this.rate = 1;
    this.direction = 1;
    this.isPlaying = false;
    this.isLooping = false;
    this.loopBegin = begin;
    this.loopEnd = end;
    /** @type {() => void} */
    this.onChange = () => {};
  }

  /** @param {number} seconds  that have passed */
  advance(seconds) {
    if (!this.isPlaying) return;
    const [low, high] = this.isLooping ? [this.loopBegin, this.loopEnd] : [this.begin, this.end];
    let time = this.time + seconds * this.rate * this.direction;
    if (this.isLooping && high > low && (time > high || time < low)) {
      time = this.direction > 0 ? low + (time - low) % (high - low)
        : high - (high - time) % (high - low);
      if (time < low || time > high) time = this.direction > 0 ? low : high;
    }
    this.time = Math.min(Math.max(time, this.begin), this.end);
    if (!this.isLooping && (this.time >= this.end && this.direction > 0
        || this.time <= this.begin && this.direction < 0)) {
      this.isPlaying = false;
    }
    this.onChange();
  }

  /** @param {number} time */
  seek(time) {
    if (Number.isFinite(time)) this.time = Math.min(Math.max(time, this.begin), this.end);
    this.onChange();
  }

  /** Plays in a direction, or pauses if already doing so; restarts at the end of the recording. */
  toggle(direction = 1) {
    if (this.isPlaying && this.direction === direction) {
      this.isPlaying = false;
    } else {
      this.direction = direction;
      this.isPlaying = true;
      if (direction > 0 && this.time >= this.end) this.time = this.begin;
      if (direction < 0 && this.time <= this.begin) this.time = this.end;
    }
    this.onChange();
  }

  pause() {
    this.isPlaying = false;
    this.onChange();
  }

  /** @param {number} steps  above 0: faster; below 0: slower */
  changeRate(steps) {
    const now = RATES.indexOf(this.rate);
    this.rate = RATES[Math.min(Math.max(now + steps, 0), RATES.length - 1)];
    this.onChange();
  }

  setLoopBegin() {
    this.loopBegin = this.time;
    if (this.loopEnd <= this.loopBegin) this.loopEnd = this.end;
    this.isLooping = true;
    this.onChange();
  }

  setLoopEnd() {
    this.loopEnd = this.time;
    if (this.loopBegin >= this.loopEnd) this.loopBegin = this.begin;
    this.isLooping = true;
    this.onChange();
  }

  toggleLoop() {
    this.isLooping = !this.isLooping;
    this.onChange();
  }
}

/**
 * Returns a time as m:ss or, from one hour on, h:mm:ss, such as 0:06.42, as in the launcher.
 * @param {number} time
 */
export function clock(time) {
  const hundredths = Math.round(Math.abs(time) * 100);
  const sign = time < 0 && hundredths ? '-' : '';
  const seconds = (hundredths % 6000 / 100).toFixed(2).padStart(5, '0');
  const minutes = Math.floor(hundredths / 6000);
  const begin = minutes < 60 ? `${minutes}`
    : `${Math.floor(minutes / 60)}:${`${minutes % 60}`.padStart(2, '0')}`;
  return `${sign}${begin}:${seconds}`;
}

/**
 * Returns the time in an address, such as #t=8.2 or #t=0:08.2; null if there is none.
 * @param {string} hash
 */
export function timeInAddress(hash) {
  const found = /[#&]t=(?:(?:(\d+):)?(\d+):)?(\d+(?:\.\d+)?)/.exec(hash);
  return found === null ? null
    : 3600 * Number(found[1] ?? 0) + 60 * Number(found[2] ?? 0) + Number(found[3]);
}
