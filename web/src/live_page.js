// SPDX-License-Identifier: BSD-3-Clause
// The page of a running cell: received data is added to the known data, and drawn like a run.

import {Link} from './link.js';
import {
  LiveClouds, LiveColumns, LiveNumber, LiveObjects, LiveTracks, arrowKey, isCloud, isFrame, isLanes,
  messagesIn, textKey,
} from './live_tracks.js';
import {Columns, unpacked} from './packed.js';
import {Page, button, made} from './page.js';
import {Transport} from './transport.js';

const SHOWN_S = 60;
const NEAR_S = 0.06;
const LONGEST_CLOUD_S = 5;  // clouds are rare on slow links
const AROUND_PX = 215;  // height above and below the scene, without the curves
const TRIM_MS = 10_000;
const RETRY_MS = 2000;

/** A position that follows the present until it is moved, and again when it reaches the end. */
class LiveTransport extends Transport {
  constructor() {
    super(0, 0);
    this.isLive = true;
  }

  /** @param {number} begin  @param {number} end  of the known data */
  extend(begin, end) {
    this.begin = begin;
    this.end = end;
    if (this.isLive) this.time = end;
    this.time = Math.max(this.time, begin);
  }

  goLive() {
    this.isLive = true;
    this.isPlaying = this.isLooping = false;
    this.rate = 1;
    this.time = this.end;
    this.onChange();
  }

  /** @param {number} seconds */
  advance(seconds) {
    super.advance(seconds);
    if (!this.isPlaying && this.direction > 0 && this.time >= this.end - NEAR_S) this.goLive();
  }

  /** @param {number} time */
  seek(time) {
    if (!Number.isFinite(time)) return;
    if (time >= this.end - NEAR_S) {
      this.goLive();
      return;
    }
    this.isLive = false;
    super.seek(time);
  }

  toggle(direction = 1) {
    if (this.isLive && direction > 0) {
      this.pause();
      return;
    }
    this.isLive = false;
    if (direction > 0 && !this.isPlaying && this.time >= this.end - NEAR_S) this.goLive();
    else super.toggle(direction);
  }

  pause() {
    this.isLive = false;
    super.pause();
  }

  setLoopBegin() {
    this.isLive = false;
    super.setLoopBegin();
  }

  setLoopEnd() {
    this.isLive = false;
    super.setLoopEnd();
  }
}

/** @param {number} time  s since the epoch */
function timeOfDay(time) {
  return new Date(1000 * time).toLocaleTimeString('en-GB');
}

/** @param {number} seconds */
function duration(seconds) {
  const whole = Math.max(Math.round(seconds), 0);
  return whole < 60 ? `${whole} s` : `${Math.floor(whole / 60)} min ${whole % 60} s`;
}

const EMPTY = {name: '', begin: 0, end: 0, numbers: [], lanes: [], alarms: [], moments: [],
  departures: [], places: [], parts: [], arrows: [], tools: {}, ghost: null, clouds: [],
  objects: {times: [], rows: []}};

/** The ghost of the reference run in the running cell, shown where its places are known.
 *  @param {any[]} parts */
function ghostOf(parts) {
  const devices = [...new Set(parts.map((it) => it.device))];
  return {parts, arrows: [], deviations: [],
    robots: devices.map((device) => ({device, shown: [[-Infinity, Infinity]]}))};
}

/** Opens the page: the models first, then the moving parts. */
export async function openLivePage() {
  const model = await modelOfCell();
  const columns = new Columns(await unpacked(model.columns));
  return new LivePage({...model, columns: undefined, runs: [{...EMPTY}]}, columns);
}

/** Fetches the models; retries until the cell provides them. */
async function modelOfCell() {
  const box = /** @type {HTMLElement} */ (document.getElementById('link'));
  for (;;) {
    try {
      const answer = await fetch('model', {cache: 'no-cache'});
      if (answer.ok) return await answer.json();
      box.textContent = (await answer.text()).slice(0, 300);
    } catch {
      box.textContent = 'The cell does not answer. Trying again …';
    }
    await new Promise((done) => { setTimeout(done, RETRY_MS); });
  }
}

class LivePage extends Page {
  /** @param {any} data  @param {Columns} columns  of meshes */
  constructor(data, columns) {
    super(data, /** @type {any} */ ({
      of: (/** @type {any} */ it) => Array.isArray(it) || ArrayBuffer.isView(it) ? it
        : columns.of(it)}));
    this.tracks = new LiveTracks();
    this.curves = new LiveColumns();
    this.clouds = new LiveClouds();
    this.objects = new LiveObjects();
    this.run.objects = this.objects;
    this.showsClouds = false;
    this.isPlaced = this.isFilled = this.isFilling = this.isSpanned = false;
    this.cellState = /** @type {any} */ ({lanes: [], alarms: [], events: []});
    this.timeline.tickText = (time) => timeOfDay(time);
    this.link = new Link(this.address(), (message) => this.take(message), () => this.showLink());
    setInterval(() => this.trim(), TRIM_MS);
  }

  /** The address of the connection; clouds are sent only on request. */
  address() {
    const url = new URL(this.showsClouds ? 'live?clouds=1' : 'live', location.href);
    url.protocol = url.protocol.replace('http', 'ws');
    return url.href;
  }

  get isEmpty() {
    return false;  // what there is comes later
  }

  makeScene() {
    super.makeScene();
    this.cloudButton = button('Cloud', 'show the clouds of depth sensors', () => {
      this.showsClouds = !this.showsClouds;
      this.cloudButton?.setAttribute('aria-pressed', String(this.showsClouds));
      this.link.move(this.address());
      this.showScene();
    });
    this.cloudButton.setAttribute('aria-pressed', 'false');
    this.cloudButton.hidden = true;
    this.sceneBox.querySelector('.views')?.append(this.cloudButton);
  }

  makeTransport() {
    return new LiveTransport();
  }

  get live() {
    return /** @type {LiveTransport} */ (this.transport);
  }

  makeBar() {
    super.makeBar();
    this.liveButton = button('Live', 'back to the present (End)', () => this.live.goLive());
    this.liveButton.classList.add('live');
    this.bar.prepend(this.liveButton);
  }

  /** @param {any} entry */
  trackOf(entry) {
    return /** @type {any} */ (new LiveNumber(entry, this.tracks.rowsOf(textKey(entry),
      () => ({times: [], texts: [], colors: []}))));
  }

  makeNumbers() {
    super.makeNumbers();
    this.numbers.forEach((it, row) => {
      const {value} = /** @type {any} */ (this.rows)[row];
      value.parentElement.hidden = it.quantity === 'note';
    });
  }

  /** @param {number} time */
  timeText(time) {
    const ago = this.transport.end - time;
    return this.live.isLive ? timeOfDay(time) : `−${ago.toFixed(1)} s  ${timeOfDay(time)}`;
  }

  keepAddress() {}  // a moment of a running cell has no address

  /** @param {number} direction */
  step(direction) {
    this.steps = /** @type {any} */ (this.stepTimes());
    super.step(direction);
  }

  /** @param {string|ArrayBuffer} message */
  take(message) {
    if (typeof message === 'string') {
      const found = JSON.parse(message);
      if (found.kind === 'layout') this.arrange(found);
      else if (found.kind === 'objects') this.takeObjects(found);
      else this.takeState(found);
      return;
    }
    const view = new DataView(message);
    if (isFrame(view)) this.takeFrame(view);
    else if (isLanes(view)) this.takeLanes(view);
    else if (isCloud(view)) this.clouds.take(view);
  }

  /** @param {any} layout */
  arrange(layout) {
    if (this.data.server !== layout.server) {  // another cell, or a restarted server
      location.reload();
      return;
    }
    this.tracks.arrange(layout);
    const rows = (/** @type {string} */ key) => /** @type {any} */ (this.tracks.rows.get(key));
    Object.assign(this.run, {
      parts: layout.parts, tools: layout.tools, numbers: layout.texts,
      places: layout.places.map((/** @type {any} */ it) => it.at ? it : rows(`place ${it.name}`)),
      arrows: layout.arrows.map((/** @type {any} */ it) => ({...it, ...rows(arrowKey(it))}))});
    this.run.ghost = layout.ghost.length > 0 ? ghostOf(layout.ghost) : null;
    if (this.ghostButton) this.ghostButton.hidden = this.run.ghost === null;
    this.numbers = layout.texts.map((/** @type {any} */ it) => this.trackOf(it));
    this.makeNumbers();
    this.showScene();
  }

  showScene() {
    this.run.clouds = this.showsClouds ? [{...this.clouds, longest: LONGEST_CLOUD_S}] : [];
    this.scene?.show(this.data, this.run, this.columns);
    this.request();
  }

  /** @param {DataView} view */
  takeFrame(view) {
    const {tracks, transport} = this;
    const before = tracks.end;
    const time = tracks.take(view);
    if (time === null) return;
    if (!this.isFilled || time - before > 1) this.fill(before, time);
    this.live.extend(tracks.begin, time);
    Object.assign(this.run, {begin: tracks.begin, end: time});
    if (!this.isPlaced && this.run.parts.length > 0) {
      this.isPlaced = true;
      this.scene?.look('cell', time);
    }
    if (this.curves.length === 0) this.follow();
    this.request();
  }

  /**
   * Fetches the data that the cell has kept between two moments.
   * @param {number} after  @param {number} before  @param {number} tries
   */
  async fill(after, before, tries = 5) {
    this.isFilled = this.isFilling = true;
    const {layout} = this.tracks;
    try {
      const from = Number.isFinite(after) ? after : 0;
      const answer = await fetch(`recent?after=${from}&before=${before}`, {cache: 'no-store'});
      if (!answer.ok) throw new Error(await answer.text());
      const found = messagesIn(await answer.arrayBuffer());
      if (layout === this.tracks.layout) this.tracks.insert(found.filter(isFrame));
      for (const it of found.filter(isLanes)) this.curves.take(it);
      this.showLanes();
      this.request();
    } catch {  // the link is lost, or there are too many requests
      if (tries > 0) setTimeout(() => this.fill(after, before, tries - 1), RETRY_MS);
    }
    this.isFilling = false;
  }

  /** @param {DataView} view */
  takeLanes(view) {
    const isGap = this.curves.take(view);
    if (isGap && !this.isFilling) this.fill(this.tracks.end, this.tracks.end);
    this.showLanes();
    this.request();
  }

  /** @param {any} message */
  takeObjects(message) {
    this.objects.take(message);
    this.request();
  }

  showLanes() {
    const {curves, timeline} = this;
    const known = this.cellState.lanes;
    const count = Math.min(known.length, curves.lanes.length);
    const before = timeline.lanes.length;
    timeline.lanes = known.slice(0, count).map((/** @type {any} */ it, /** @type {number} */ row) => {
      const {low, high, band, hasBand} = curves.lanes[row];
      return {...it, low, high, begin: curves.epoch + curves.first * it.step,
        band: hasBand ? band : null};
    });
    if (count !== before) {
      this.box.style.setProperty('--below', `${timeline.height + AROUND_PX}px`);
      timeline.resize();
    }
    this.follow();
  }

  /** Ends the timeline at the present, unless the viewer looks back. */
  follow() {
    const {timeline, transport, curves} = this;
    const step = this.cellState.lanes[0]?.step ?? 1;
    const first = curves.length > 0 ? curves.epoch + curves.first * step : transport.begin;
    timeline.from = Math.min(first, transport.begin);
    timeline.to = transport.end;
    const span = this.isSpanned ? timeline.end - timeline.begin : SHOWN_S;
    this.isSpanned = true;
    if (this.live.isLive) {
      timeline.end = transport.end;
      timeline.begin = transport.end - span;
    }
    timeline.isStale = true;
  }

  trim() {
    this.tracks.trim();
    this.objects.trim(this.tracks.begin);
    this.curves.trim(this.cellState.lanes[0]?.step ?? 1);
  }

  /** @param {any} state */
  takeState(state) {
    this.cellState = state;
    const end = this.transport.end;
    Object.assign(this.run, {
      moments: state.marks, alarms: state.alarms.map((/** @type {any} */ it) =>
        ({begin: it.begin, end: it.end ?? Math.max(end, it.begin)})),
      departures: state.departures});
    this.timeline.run = this.run;
    if (this.cloudButton) this.cloudButton.hidden = !state.has_clouds;
    this.showLanes();
    this.showAlarms(state);
    const verdict = /** @type {HTMLElement} */ (document.getElementById('verdict'));
    verdict.hidden = !state.verdict;
    verdict.className = `verdict ${state.verdict?.state ?? 'plain'}`;
    verdict.replaceChildren(made('b', state.verdict?.text ?? ''),
      document.createTextNode(state.verdict?.reference ? ` (${state.verdict.reference})` : ''));
    for (const [id, text] of [['recording', state.recording], ['viewers', state.viewers]]) {
      const element = document.getElementById(id);
      if (element !== null) element.textContent = text;
    }
    document.getElementById('recording')?.classList.toggle('on', Boolean(state.is_recording));
    this.showLink();
    this.request();
  }

  /** @param {any} state */
  showAlarms(state) {
    const list = /** @type {HTMLElement} */ (document.getElementById('alarms'));
    const rows = state.alarms.map((/** @type {any} */ it) => this.alarmRow(it.text, it.begin,
      it.end === null ? `since ${timeOfDay(it.begin)}`
        : `${timeOfDay(it.begin)}, for ${duration(it.end - it.begin)}`, `alarm level${it.level}`));
    if (rows.length === 0) rows.push(made('li', 'No alarms', 'none'));
    list.replaceChildren(...rows);
    const events = /** @type {HTMLElement} */ (document.getElementById('events'));
    events.replaceChildren(...state.events.map((/** @type {any} */ it) =>
      this.alarmRow(it.text, it.time, timeOfDay(it.time), 'event')));
  }

  /** @param {string} text @param {number} time @param {string} when @param {string} style */
  alarmRow(text, time, when, style) {
    const row = made('li', '', style);
    const go = made('button', when, 'go');
    go.setAttribute('aria-label', `${text}: show ${when}`);
    go.addEventListener('click', () => {
      this.transport.pause();
      this.transport.seek(Math.max(time, this.transport.begin));
    });
    row.append(made('span', text), go);
    return row;
  }

  /** Shows whether the page shows the present. */
  showLink() {
    const {link, live} = this;
    if (link === undefined) return;
    const box = /** @type {HTMLElement} */ (document.getElementById('link'));
    const problem = this.cellState.problem;
    let [text, style] = ['', 'good'];
    if (link.lostAt !== null) {
      const since = (Date.now() - link.lostAt) / 1000;
      text = link.refusal || `No connection to the cell since ${timeOfDay(link.lostAt / 1000)} `
        + `(${duration(since)}): what is shown is old. Trying again …`;
      style = 'lost';
    } else if (problem) {
      text = `${problem.text} since ${timeOfDay(problem.since)}: what is shown is old.`;
      style = 'lost';
    } else if (!Number.isFinite(this.tracks.end)) {
      text = 'Waiting for the cell …';
    } else if (live.isLive) {
      text = `Live${this.cellState.playback ? `: ${this.cellState.playback}` : ''}`;
    } else {
      text = `Looking back: ${timeOfDay(live.time)}, `
        + `${duration(live.end - live.time)} ago. The cell goes on.`;
      style = 'back';
    }
    if (box.textContent !== text) box.textContent = text;
    box.className = `link ${style}`;
    document.documentElement.classList.toggle('lost', style === 'lost');
  }

  /** @param {number} time */
  drawBar(time) {
    super.drawBar(time);
    if (this.live.isLive && this.play) {
      this.play.textContent = '❚❚';
      this.play.setAttribute('aria-pressed', 'true');
    }
    this.liveButton?.setAttribute('aria-pressed', String(this.live.isLive));
    if (this.live.isLive && this.transport.end - this.timeline.end > 1) this.follow();
    this.showLink();
  }

  /** @param {KeyboardEvent} event */
  action(event) {
    if (event.key === 'End') return () => this.live.goLive();
    return super.action(event);
  }
}
