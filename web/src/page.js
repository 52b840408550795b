// SPDX-License-Identifier: BSD-3-Clause
// The page of a run: its data, and draw(time). The texts are already in the document.

import {cssColor} from './css_color.js';
import {NumberTrack} from './numbers.js';
import {CellScene, graphics} from './scene.js';
import {Timeline} from './timeline.js';
import {between, isWithin} from './tracks.js';
import {RATES, Transport, clock, timeInAddress} from './transport.js';

const LONGEST_FRAME_S = 5;  // slow computers keep time; after sleep, playback resumes where it was
const VIEWS = [['cell', 'Cell'], ['tools', 'Tools'], ['front', 'Front'], ['side', 'Side'],
  ['top', 'Top']];
const KEYS = [
  ['Space', 'play or pause'], ['Shift+Space', 'play backwards'], ['← →  , .', 'one step'],
  ['Shift+← →', '1 s'], ['[ ]', 'slower, faster'], ['Home End', 'to the beginning, the end'],
  ['A B', 'loop from here, to here'], ['L', 'loop'], ['PgUp PgDn', 'previous, next mark'],
  ['+ −', 'zoom the timeline'], ['?', 'these keys']];

/** @param {string} name  @param {string} [text]  @param {string} [style] */
export function made(name, text = '', style = '') {
  const found = document.createElement(name);
  if (text) found.textContent = text;
  if (style) found.className = style;
  return found;
}

/** @param {string} text  @param {string} label  @param {() => void} act */
export function button(text, label, act) {
  const found = /** @type {HTMLButtonElement} */ (made('button', text));
  found.type = 'button';
  found.title = label;
  found.setAttribute('aria-label', label);
  found.addEventListener('click', act);
  return found;
}

/** Returns whether the page is for a film, which requests each picture (`filmFrame`). */
function isFilm() {
  return location.hash === '#film';
}

/** The page. */
export class Page {
  /** @param {any} data  @param {import('./packed.js').Columns} columns */
  constructor(data, columns) {
    this.data = data;
    this.columns = columns;
    this.box = /** @type {HTMLElement} */ (document.getElementById('player'));
    this.sceneBox = made('div', '', 'scene');
    this.bar = made('div', '', 'bar');
    this.bar.setAttribute('role', 'toolbar');
    this.bar.setAttribute('aria-label', 'Playback');
    this.timelineBox = made('div', '', 'timeline');
    this.box.append(this.sceneBox, this.bar, this.timelineBox);
    this.transport = this.makeTransport();
    this.timeline = new Timeline(this.timelineBox, (time) => this.transport.seek(time));
    /** @type {CellScene|null} */
    this.scene = null;
    this.isDue = false;
    this.before = NaN;  // time of the previous frame while playing [ms]
    /** @type {NumberTrack[]} */
    this.numbers = [];
    this.makeScene();
    this.makeBar();
    this.makeSlider();
    this.makeKeys();
    this.makeLinks();
    this.show(this.runInAddress());
    this.listen();
  }

  makeTransport() {
    return new Transport(0, 1);
  }

  /** @param {any} entry  of a number */
  trackOf(entry) {
    return new NumberTrack(entry, this.columns);
  }

  /** Returns the displayed position.  @param {number} time */
  timeText(time) {
    return `${clock(time)} / ${clock(this.run.end)}`;
  }

  /** Returns the run that contains the moment in the address. */
  runInAddress() {
    const time = timeInAddress(location.hash);
    return Math.max(this.data.runs.findIndex((/** @type {any} */ it) => time !== null
      && it.begin <= time && time <= it.end), 0);
  }

  get run() {
    return this.data.runs[this.number];
  }

  makeScene() {
    const found = graphics(isFilm());
    if (found === null) {
      this.sceneBox.classList.add('without');
      this.sceneBox.append(made('p', 'This browser shows no pictures in three dimensions (WebGL '
        + 'is off or missing). Verdict, curves and numbers work as everywhere.'));
      return;
    }
    this.scene = new CellScene(this.sceneBox, () => this.request(), isFilm(), found);
    const views = made('div', '', 'views');
    for (const [name, text] of VIEWS) {
      views.append(button(text, `view: ${text.toLowerCase()}`, () => {
        this.scene?.look(name, this.transport.time);
        this.request();
      }));
    }
    this.ghostButton = button('Good run', 'show the good run as a ghost', () => this.toggleGhost());
    this.ghostButton.setAttribute('aria-pressed', 'true');
    views.append(this.ghostButton);
    this.empty = made('p', 'There is nothing to show in three dimensions: no model of a robot or '
      + 'machine, no arrow and no cloud.', 'nothing');
    this.sceneBox.append(views, this.empty);
  }

  /** Whether the picture has nothing to show. */
  get isEmpty() {
    const {parts, arrows, clouds, objects} = this.run;
    return parts.length + arrows.length + clouds.length === 0
      && this.columns.of(objects.times).length === 0;
  }

  toggleGhost() {
    if (this.scene === null || !this.ghostButton) return;
    this.scene.showsGhost = !this.scene.showsGhost;
    this.ghostButton.setAttribute('aria-pressed', String(this.scene.showsGhost));
    this.request();
  }

  makeBar() {
    const {transport} = this;
    this.play = button('▶', 'play or pause (Space)', () => transport.toggle());
    this.play.classList.add('play');
    this.back = button('◀', 'play backwards (Shift+Space)', () => transport.toggle(-1));
    this.loop = button('⟲', 'loop (L)', () => transport.toggleLoop());
    this.rate = /** @type {HTMLSelectElement} */ (made('select'));
    this.rate.setAttribute('aria-label', 'rate');
    for (const it of RATES) {
      const option = /** @type {HTMLOptionElement} */ (made('option', `× ${it}`));
      option.value = String(it);
      this.rate.append(option);
    }
    this.rate.addEventListener('change', () => {
      transport.rate = Number(this.rate?.value);
      transport.onChange();
    });
    this.clock = made('output', '', 'clock');
    this.clock.setAttribute('aria-label', 'position');
    this.bar.append(this.back, button('‹', 'one step back (←)', () => this.step(-1)), this.play,
      button('›', 'one step forward (→)', () => this.step(1)), this.clock, this.rate, this.loop,
      button('A', 'loop from here (A)', () => transport.setLoopBegin()),
      button('B', 'loop to here (B)', () => transport.setLoopEnd()), made('span', '', 'gap'),
      button('◐', 'light or dark', () => this.toggleTheme()),
      button('?', 'keys (?)', () => this.help?.showModal()));
  }

  makeSlider() {
    const box = this.timelineBox;
    box.tabIndex = 0;
    box.setAttribute('role', 'slider');
    box.setAttribute('aria-label', 'position in the recording');
  }

  makeKeys() {
    this.help = /** @type {HTMLDialogElement} */ (made('dialog'));
    const table = made('table');
    for (const [keys, text] of KEYS) {
      const row = made('tr');
      row.append(made('th', keys), made('td', text));
      table.append(row);
    }
    const form = /** @type {HTMLFormElement} */ (made('form'));
    const close = /** @type {HTMLButtonElement} */ (made('button', 'Close'));
    close.addEventListener('click', (event) => { event.preventDefault(); this.help?.close(); });
    form.append(made('h2', 'Keys'), table, close);
    this.help.append(form);
    document.body.append(this.help);
  }

  /** Links the rows of the tables in the document to their moments and runs. */
  makeLinks() {
    for (const it of document.querySelectorAll('[data-time]')) {
      const link = /** @type {HTMLElement} */ (it);
      link.addEventListener('click', (event) => {
        event.preventDefault();
        const run = Number(link.dataset.run);
        if (run !== this.number) this.show(run);
        this.transport.pause();
        this.transport.seek(Number(link.dataset.time));
        this.keepAddress();
      });
    }
  }

  /** @param {number} number  of a run */
  show(number) {
    this.number = number;
    const {run, transport} = this;
    transport.begin = transport.loopBegin = run.begin;
    transport.end = transport.loopEnd = run.end;
    transport.isPlaying = transport.isLooping = false;
    const address = timeInAddress(location.hash);
    const isHere = address !== null && run.begin <= address && address <= run.end;
    transport.time = isHere ? address : opening(run);
    this.numbers = run.numbers.map((/** @type {any} */ it) => this.trackOf(it));
    this.makeNumbers();
    this.steps = this.stepTimes();
    this.timeline.show(run, this.columns);
    this.timeline.resize();
    if (this.scene !== null) {
      this.scene.show(this.data, run, this.columns);
      if (this.empty) this.empty.hidden = !this.isEmpty;
      this.scene.resize();
      this.scene.look('cell', transport.time);
      if (this.ghostButton) this.ghostButton.hidden = run.ghost === null;
    }
    this.applyTheme();
    for (const it of document.querySelectorAll('section[data-run]')) {
      const section = /** @type {HTMLElement} */ (it);
      section.classList.toggle('shown', Number(section.dataset.run) === number);
    }
    this.request();
  }

  /** Returns the moments for single steps: the rows of a moving place, or else of a number. */
  stepTimes() {
    const moving = this.run.places.filter((/** @type {any} */ it) => it.times);
    const found = moving.length > 0 ? this.columns.of(moving[0].times)
      : this.numbers.length > 0 ? this.numbers[0].times : [];
    return Array.from(found).filter((it) => it >= this.run.begin && it <= this.run.end);
  }

  /** @param {number} direction */
  step(direction) {
    const {transport, steps} = this;
    transport.pause();
    const tiny = 1e-6;
    const next = direction > 0 ? steps.find((it) => it > transport.time + tiny)
      : steps.findLast((it) => it < transport.time - tiny);
    transport.seek(next ?? (direction > 0 ? transport.end : transport.begin));
    this.keepAddress();
  }

  makeNumbers() {
    const box = /** @type {HTMLElement} */ (document.getElementById('numbers'));
    box.replaceChildren();
    this.rows = this.numbers.map((number) => {
      const row = made('tr');
      const mark = made('i');
      const name = made('th', number.device);
      name.prepend(mark);
      const value = made('td');
      row.append(name, value);
      box.append(row);
      return {mark, value};
    });
    const {ghost} = this.run;
    this.distances = (ghost ? ghost.deviations : []).map((/** @type {any} */ it) => {
      const row = made('tr');
      const name = made('th', it.device);
      const mark = made('i');
      mark.style.background = cssColor(this.data.ghost.deviation);
      name.prepend(mark);
      const value = made('td');
      row.append(name, value);
      box.append(row);
      return {device: it.device, value, track: {times: this.columns.of(it.times),
        rows: this.columns.of(it.rows), shown: it.shown}};
    });
  }

  /** Requests a redraw. */
  request() {
    if (this.isDue) return;
    this.isDue = true;
    requestAnimationFrame((now) => this.frame(now));
  }

  /** @param {number} now  in ms */
  frame(now) {
    this.isDue = false;
    const {transport} = this;
    const passed = (now - this.before) / 1000;
    if (transport.isPlaying && passed > 0) transport.advance(Math.min(passed, LONGEST_FRAME_S));
    this.before = transport.isPlaying ? now : NaN;
    this.draw(transport.time);
    if (transport.isPlaying) this.request();
  }

  /** Draws the page at a time of the recording.  @param {number} time */
  draw(time) {
    this.scene?.draw(time, this.numbers);
    this.timeline.draw(this.transport);
    this.numbers.forEach((number, row) => {
      const {text, color} = number.at(time);
      const {mark, value} = /** @type {any} */ (this.rows)[row];
      if (value.textContent !== text) value.textContent = text;
      mark.style.background = cssColor(color);
    });
    for (const {value, track} of /** @type {any} */ (this.distances)) {
      value.textContent = distanceText(track, time);
    }
    this.drawBar(time);
    document.documentElement.dataset.time = time.toFixed(4);
  }

  /** @param {number} time */
  drawBar(time) {
    const {transport, timelineBox, run} = this;
    const text = this.timeText(time);
    if (this.clock && this.clock.textContent !== text) this.clock.textContent = text;
    const [play, back] = /** @type {any} */ ([this.play, this.back]);
    const isForward = transport.isPlaying && transport.direction > 0;
    play.textContent = isForward ? '❚❚' : '▶';
    play.setAttribute('aria-pressed', String(isForward));
    back.setAttribute('aria-pressed', String(transport.isPlaying && transport.direction < 0));
    this.loop?.setAttribute('aria-pressed', String(transport.isLooping));
    if (this.rate) this.rate.value = String(transport.rate);
    for (const [name, value] of [['min', run.begin], ['max', run.end], ['now', time]]) {
      timelineBox.setAttribute(`aria-value${name}`, Number(value).toFixed(2));
    }
    timelineBox.setAttribute('aria-valuetext', clock(time));
  }

  /** Writes this moment into the address. */
  keepAddress() {
    history.replaceState(null, '', `#t=${this.transport.time.toFixed(2)}`);
  }

  listen() {
    this.transport.onChange = () => {
      if (!this.transport.isPlaying) this.keepAddressSoon();
      this.request();
    };
    addEventListener('hashchange', () => {
      const time = timeInAddress(location.hash);
      if (time !== null) this.transport.seek(time);
    });
    addEventListener('keydown', (event) => this.key(event));
    new ResizeObserver(() => {
      this.timeline.resize();
      this.scene?.resize();
      this.request();
    }).observe(this.box);
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.applyTheme());
    document.addEventListener('visibilitychange', () => { this.before = NaN; });
    addEventListener('beforeprint', () => this.print(true));
    addEventListener('afterprint', () => this.print(false));
  }

  /** Draws for paper, dark on light and as wide as its sheet (page.css), or again for the screen.
   *  @param {boolean} isBegun */
  print(isBegun) {
    const {dataset, classList} = document.documentElement;
    if (isBegun) this.theme = dataset.theme;
    if (isBegun) dataset.theme = 'light';
    else if (this.theme) dataset.theme = this.theme;
    else delete dataset.theme;
    classList.toggle('printed', isBegun);
    this.timeline.resize();
    this.scene?.resize();
    this.applyTheme();
    this.draw(this.transport.time);
    this.scene?.keepStill(isBegun);
  }

  /** Updates the address after a pause, because browsers limit the rate of changes. */
  keepAddressSoon() {
    clearTimeout(this.later);
    this.later = setTimeout(() => this.keepAddress(), 200);
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const target = /** @type {HTMLElement} */ (event.target);
    if (event.ctrlKey || event.altKey || event.metaKey || target.closest('select, dialog')) return;
    if (event.key === 'Enter' || event.key === ' ' && target.closest('button, a')) {
      if (event.key === ' ') target.blur();
      else return;
    }
    const act = this.action(event);
    if (act === undefined) return;
    event.preventDefault();
    act();
  }

  /** @param {KeyboardEvent} event  @returns {(() => void)|undefined} */
  action(event) {
    const {transport, timeline} = this;
    const jump = (/** @type {number} */ by) => () => transport.seek(transport.time + by);
    const name = (event.shiftKey && event.key !== '?' && event.key !== '+' ? 'Shift+' : '')
      + (event.key.length === 1 ? event.key.toLowerCase() : event.key);
    /** @type {Record<string, () => void>} */
    const actions = {
      ' ': () => transport.toggle(), 'Shift+ ': () => transport.toggle(-1),
      ArrowLeft: () => this.step(-1), ArrowRight: () => this.step(1),
      ',': () => this.step(-1), '.': () => this.step(1),
      'Shift+ArrowLeft': jump(-1), 'Shift+ArrowRight': jump(1),
      '[': () => transport.changeRate(-1), ']': () => transport.changeRate(1),
      Home: () => transport.seek(transport.begin), End: () => transport.seek(transport.end),
      a: () => transport.setLoopBegin(), b: () => transport.setLoopEnd(),
      l: () => transport.toggleLoop(), PageUp: () => this.toMark(-1),
      PageDown: () => this.toMark(1), '+': () => timeline.zoom(1, transport.time),
      '-': () => timeline.zoom(-1, transport.time), '?': () => this.help?.showModal(),
    };
    return actions[name];
  }

  /** @param {number} direction */
  toMark(direction) {
    const {run, transport} = this;
    const times = [...run.moments.map((/** @type {any} */ it) => it.at),
      ...run.departures.map((/** @type {any} */ it) => it.began_s)].sort((a, b) => a - b);
    const next = direction > 0 ? times.find((it) => it > transport.time + 1e-3)
      : times.findLast((it) => it < transport.time - 1e-3);
    if (next !== undefined) transport.seek(next);
  }

  /**
   * Prepares for a film: only the cell, a caption and some curves are shown.
   * @param {{curves: string[], dark: boolean}} style  curves: if empty, as many as fit
   */
  film({curves, dark}) {
    const {dataset} = document.documentElement;
    dataset.film = '';
    dataset.theme = dark ? 'dark' : 'light';
    this.caption = made('p', '', 'caption');
    this.sceneBox.append(this.caption);
    this.filmStyle = {curves};
  }

  /**
   * Draws a frame of a film, and returns its numbers as texts, by device and label.
   * @param {number} number  of the run  @param {number} time
   * @param {[[string, number], [string, number], number]} camera  two views, and the share between
   */
  async filmFrame(number, time, camera) {
    const {transport, filmStyle} = this;
    if (this.filmed !== number && filmStyle) {
      this.filmed = number;
      this.show(number);
      this.timeline.keep(filmStyle.curves, 0.4 * innerHeight);
      this.timeline.resize();
      this.scene?.resize();
      this.applyTheme();
    }
    transport.time = time;
    this.scene?.lookBetween(...camera);
    if (this.caption) {
      this.caption.replaceChildren(made('b', this.run.name), ` ${clock(time)} `,
        made('span', this.run.verdict.split(';')[0], `${this.run.state}-text`));
      if (this.scene) this.scene.labelsFrom = this.caption.offsetTop + this.caption.offsetHeight + 2;
    }
    this.draw(time);
    await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
    const distances = /** @type {any[]} */ (this.distances);
    return [...this.numbers.map((it) => [it.device, it.label, it.at(time).text]),
      ...distances.map((it) => [it.device, 'deviation', it.value.textContent])];
  }

  toggleTheme() {
    const {dataset} = document.documentElement;
    dataset.theme = this.isDark() ? 'light' : 'dark';
    this.applyTheme();
  }

  isDark() {
    const {theme} = document.documentElement.dataset;
    return theme ? theme === 'dark' : matchMedia('(prefers-color-scheme: dark)').matches;
  }

  applyTheme() {
    this.scene?.setBackground(this.isDark() ? 0x23282d : 0xeef1f3);
    this.timeline.isStale = true;
    this.request();
  }
}

/**
 * Returns the first shown moment of a run; if it is poor, one where its first departure is visible.
 * @param {any} run
 */
function opening(run) {
  const first = run.departures[0];
  const time = first ? Math.min(Math.max(first.began_s, first.worst_s), first.began_s + 1)
    : run.begin;
  return Math.min(Math.max(time, run.begin), run.end);
}

/** @param {any} track  @param {number} time */
function distanceText(track, time) {
  const rows = [0, 0, 0, 0, 0, 0];
  const isKnown = isWithin(track.shown, time) && between(track.times, track.rows, time, rows);
  if (!isKnown) return 'Δ –';
  return `Δ ${(1000 * Math.hypot(rows[3], rows[4], rows[5])).toFixed(1)} mm from the good run`;
}
