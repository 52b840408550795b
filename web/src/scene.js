// SPDX-License-Identifier: BSD-3-Clause
// The cell in three dimensions at a moment: models, arrows, the reference as a ghost, labels.

import {
  AmbientLight, BoxGeometry, BufferAttribute, BufferGeometry, Box3, Color, ColorManagement,
  ConeGeometry, CylinderGeometry, DirectionalLight, DoubleSide, EdgesGeometry, GridHelper, Group,
  LineBasicMaterial, LineSegments, LinearSRGBColorSpace, Mesh, MeshBasicMaterial,
  MeshLambertMaterial, PerspectiveCamera, Points, PointsMaterial, Quaternion, Scene, Vector3,
  WebGLRenderer,
} from 'three';
import {OrbitControls} from 'three/addons/controls/OrbitControls.js';
import {cssColor} from './css_color.js';
import {between, held, isWithin, placeAt, rowAt} from './tracks.js';

ColorManagement.enabled = false;  // keep the colors of the files, as in RViz

const SHAFT = 0.77;  // share of an arrow's length, as in RViz
const LONGEST_CLOUD_S = 1;
const OBJECT_LINE_M = 0.008;  // as in RViz
const OBJECT_LABEL_M = 0.1;
const LABEL_ABOVE_M = 0.22;  // clear of the wrist
const MOST_LINES = 8;  // of a label; more would hide the cell
const MOST_PIXELS = 1.6e6;  // more is too slow without a graphics card
const X_AXIS = new Vector3(1, 0, 0);
const AT_TOOL = ['speed', 'force', 'joints', 'deviation'];

/**
 * Returns a canvas for drawing in three dimensions; null if the browser cannot. Without a graphics
 * card, edges are not smoothed, which would cost too much.
 * @param {boolean} isFilm  whether each picture may take any time
 * @returns {{canvas: HTMLCanvasElement, context: WebGL2RenderingContext}|null}
 */
export function graphics(isFilm) {
  const plain = drawable(isFilm);
  if (plain === null || isFilm || isSlow(plain.context)) return plain;
  plain.context.getExtension('WEBGL_lose_context')?.loseContext();
  return drawable(true);
}

/** @param {boolean} antialias */
function drawable(antialias) {
  const canvas = document.createElement('canvas');
  const context = canvas.getContext('webgl2', {antialias, preserveDrawingBuffer: true});
  return context === null ? null : {canvas, context};
}

/** Returns whether there is no graphics card.  @param {WebGL2RenderingContext} context */
function isSlow(context) {
  const names = context.getExtension('WEBGL_debug_renderer_info');
  return Boolean(names && /swiftshader|llvmpipe|softpipe|software|basic render/i.test(
    context.getParameter(names.UNMASKED_RENDERER_WEBGL)));
}

/** @typedef {{text: string, color: number[], kind: string}} Line */

/** Draws one run of a page. */
export class CellScene {
  /**
   * @param {HTMLElement} box  in which the scene is drawn
   * @param {() => void} onView  called when the camera moves
   * @param {boolean} isFilm  whether each picture may take any time
   * @param {{canvas: HTMLCanvasElement, context: WebGL2RenderingContext}} graphics
   */
  constructor(box, onView, isFilm, {canvas, context}) {
    this.box = box;
    this.isFilm = isFilm;
    this.renderer = new WebGLRenderer({canvas, context});
    this.renderer.outputColorSpace = LinearSRGBColorSpace;
    this.canvas = canvas;
    this.canvas.setAttribute('aria-label', 'The cell in three dimensions');
    this.canvas.setAttribute('role', 'img');
    box.append(this.canvas);
    this.labels = document.createElement('div');
    this.labels.className = 'labels';
    box.append(this.labels);
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(40, 1, 0.02, 100);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.addEventListener('change', onView);
    this.scene.add(new AmbientLight(0xffffff, 1.5));
    this.scene.add(this.camera);
    for (const [x, y, z, strength] of [[0.5, 1, 1.5, 1.5], [-1.5, -0.5, 0.5, 0.7]]) {
      const light = new DirectionalLight(0xffffff, strength);
      light.position.set(x, y, z);
      this.camera.add(light);
    }
    this.world = new Group();
    this.scene.add(this.world);
    this.arrowShape = arrowGeometry();
    /** @type {Map<number, BufferGeometry>} */
    this.geometries = new Map();
    this.plain = new MeshLambertMaterial({vertexColors: true, side: DoubleSide});
    this.showsGhost = true;
    this.labelsFrom = 2;  // pixels below the top edge
  }

  /**
   * @param {any} page  the data of the page
   * @param {any} run  one of its runs
   * @param {import('./packed.js').Columns} columns
   */
  show(page, run, columns) {
    this.release();
    this.labels.replaceChildren();
    this.page = page;
    this.columns = columns;
    this.places = run.places.map((/** @type {any} */ it) => it.at ? it : {
      times: columns.of(it.times), positions: columns.of(it.positions),
      turns: columns.of(it.turns), between: it.between});
    this.parts = run.parts.map((/** @type {any} */ it) => this.part(it, this.plain))
      .filter(Boolean);
    this.arrows = run.arrows.map((/** @type {any} */ it) => this.arrow(it));
    this.ghost = run.ghost === null ? null : this.ghostOf(run.ghost, page.ghost);
    this.clouds = run.clouds.map((/** @type {any} */ it) => this.cloud(it));
    this.objects = {group: new Group(), times: columns.of(run.objects.times),
      rows: run.objects.rows, shown: /** @type {any} */ (null)};
    this.world.add(this.objects.group);
    this.tools = Object.entries(run.tools);
    this.blocks = new Map();
    this.floor = null;
    this.floorParts = 0;
  }

  /** Removes everything that is shown, and frees its memory on the graphics card. */
  release() {
    const kept = new Set([this.arrowShape, this.plain, ...this.geometries.values()]);
    this.world.traverse((/** @type {any} */ it) => {
      for (const owned of [it.geometry, it.material]) {
        if (owned && !kept.has(owned)) owned.dispose();
      }
    });
    this.world.clear();
  }

  /** @param {any} part  @param {any} material */
  part(part, material) {
    if (part.place === null) return null;
    const mesh = new Mesh(this.geometry(part.mesh), material);
    mesh.matrixAutoUpdate = false;
    this.world.add(mesh);
    return {mesh, place: this.places[part.place], device: part.device,
      isFixed: Boolean(this.places[part.place].at)};
  }

  /** @param {number} number */
  geometry(number) {
    let found = this.geometries.get(number);
    if (found === undefined) {
      const mesh = this.page.meshes[number];
      found = new BufferGeometry();
      found.setAttribute('position', new BufferAttribute(this.columns.of(mesh.positions), 3));
      found.setAttribute('normal', new BufferAttribute(this.columns.of(mesh.normals), 3, true));
      found.setAttribute('color', new BufferAttribute(this.columns.of(mesh.colors), 3, true));
      found.setIndex(new BufferAttribute(this.columns.of(mesh.triangles), 1));
      found.computeBoundingSphere();
      found.computeBoundingBox();
      this.geometries.set(number, found);
    }
    return found;
  }

  /** @param {any} entry */
  arrow(entry) {
    const mesh = new Mesh(this.arrowShape, new MeshLambertMaterial(
      {color: new Color(...entry.color), emissive: new Color(...entry.color),
        emissiveIntensity: 0.35}));
    mesh.frustumCulled = false;
    this.world.add(mesh);
    return {mesh, frame: this.places[entry.frame], foot: this.places[entry.footFrame],
      offset: new Vector3(...entry.foot ?? []), times: this.columns.of(entry.times),
      vectors: this.columns.of(entry.vectors), vectorAt: entry.between ? between : held,
      diameter: entry.diameter, beside: entry.beside, device: entry.device,
      quantity: entry.quantity, isVariable: entry.variable, tip: new Vector3(), feet: entry.feet ?? null,
      colors: entry.colors ?? null};
  }

  /** @param {any} entry */
  cloud(entry) {
    const points = new Points(new BufferGeometry(), new PointsMaterial(
      {size: 0.012, vertexColors: true}));
    points.frustumCulled = false;
    this.world.add(points);
    return {points, times: this.columns.of(entry.times), clouds: entry.clouds, shown: null,
      longest: entry.longest ?? LONGEST_CLOUD_S};
  }

  /** Shows the last cloud, unless it is too old.  @param {any} cloud  @param {number} time */
  setCloud(cloud, time) {
    const row = rowAt(cloud.times, time);
    cloud.points.visible = row >= 0 && time - cloud.times[row] < cloud.longest;
    if (!cloud.points.visible || cloud.clouds[row] === cloud.shown) return;
    cloud.shown = cloud.clouds[row];
    const {positions, colors} = cloud.shown;
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(this.columns.of(positions), 3));
    geometry.setAttribute('color', new BufferAttribute(this.columns.of(colors), 3, true));
    cloud.points.geometry.dispose();
    cloud.points.geometry = geometry;
  }

  /** Shows the unmodeled objects of a moment.  @param {number} time */
  setObjects(time) {
    const {objects} = this;
    const row = rowAt(objects.times, time);
    const found = row < 0 ? [] : objects.rows[row];
    if (found === objects.shown) return;
    objects.shown = found;
    for (const it of objects.group.children) {
      const {geometry, material} = /** @type {any} */ (it);
      geometry.dispose();
      material.dispose();
    }
    objects.group.clear();
    for (const it of found) objects.group.add(...shapesOf(it));
  }

  /** @param {any} ghost  @param {any} style */
  ghostOf(ghost, style) {
    const material = new MeshLambertMaterial({color: new Color(...style.color.slice(0, 3)),
      transparent: true, opacity: style.color[3]});
    const spans = new Map(ghost.robots.map((/** @type {any} */ it) => [it.device, it.shown]));
    const deviations = ghost.deviations.map((/** @type {any} */ it) => {
      const mesh = new Mesh(this.arrowShape, new MeshBasicMaterial(
        {color: new Color(...style.deviation.slice(0, 3))}));
      mesh.frustumCulled = false;
      this.world.add(mesh);
      return {device: it.device, mesh, times: this.columns.of(it.times),
        rows: this.columns.of(it.rows), shown: it.shown, at: new Vector3()};
    });
    return {spans, style, deviations,
      parts: ghost.parts.map((/** @type {any} */ it) => this.part(it, material)).filter(Boolean),
      arrows: ghost.arrows.map((/** @type {any} */ it) => this.arrow(it))};
  }

  /**
   * Draws the scene at a moment.
   * @param {number} time
   * @param {import('./numbers.js').NumberTrack[]} numbers
   */
  draw(time, numbers) {
    for (const part of this.parts) setPlace(part.mesh, part.place, time);
    for (const arrow of this.arrows) setArrow(arrow, time, true);
    for (const cloud of this.clouds) this.setCloud(cloud, time);
    this.setObjects(time);
    this.drawGhost(time);
    const count = this.parts.filter((/** @type {any} */ it) => it.mesh.visible).length;
    if (this.floor === null || count > this.floorParts) this.addFloor(count);
    this.renderer.render(this.scene, this.camera);
    this.drawLabels(time, numbers);
  }

  /** @param {number} time */
  drawGhost(time) {
    if (this.ghost === null) return;
    const {spans, parts, arrows, deviations} = this.ghost;
    for (const part of parts) {
      part.mesh.visible = this.showsGhost && isWithin(spans.get(part.device), time);
      if (part.mesh.visible) setPlace(part.mesh, part.place, time);
    }
    for (const arrow of arrows) setArrow(arrow, time, this.showsGhost);
    for (const it of deviations) setDeviation(it, time, this.ghost.style, this.showsGhost);
  }

  /** Lays a floor below the cell.  @param {number} count  of the parts that are in view */
  addFloor(count) {
    this.floor?.removeFromParent();
    this.floor = new Group();
    this.floorParts = count;
    const box = this.bounds(false);
    if (box.isEmpty()) return;
    const size = Math.ceil(2 * Math.max(box.max.x - box.min.x, box.max.y - box.min.y) + 1);
    const grid = new GridHelper(size, 2 * size, 0x8a949c, 0x8a949c);
    grid.material.transparent = true;
    grid.material.opacity = 0.35;
    grid.rotation.x = Math.PI / 2;
    const middle = box.getCenter(new Vector3());
    grid.position.set(Math.round(middle.x), Math.round(middle.y), box.min.z);
    this.floor.add(grid);
    this.world.add(this.floor);
  }

  /** Returns the box around all moving parts, or around all parts.  @param {boolean} onlyMoving */
  bounds(onlyMoving) {
    const box = new Box3();
    for (const part of this.parts) {
      if ((onlyMoving && part.isFixed) || !part.mesh.visible) continue;
      const geometry = part.mesh.geometry.boundingBox.clone();
      box.union(geometry.applyMatrix4(part.mesh.matrix));
    }
    return box;
  }

  /**
   * Looks at the cell from a side.
   * @param {string} name  of the view
   * @param {number} time
   */
  look(name, time) {
    const {center, eye} = this.viewOf(name, time);
    this.controls.target.copy(center);
    this.camera.position.copy(eye);
    this.controls.update();
  }

  /**
   * Looks at the cell from between two views; the way leads around the cell, not through it.
   * @param {[string, number]} begin  name and time of the view
   * @param {[string, number]} end
   * @param {number} share  of the way between them
   */
  lookBetween(begin, end, share) {
    const [from, to] = [this.viewOf(...begin), this.viewOf(...end)];
    const {target} = this.controls;
    target.lerpVectors(from.center, to.center, share);
    const [before, behind] = [from, to].map(({center, eye}) => eye.clone().sub(center));
    const distance = before.length() + share * (behind.length() - before.length());
    const turn = new Quaternion().slerp(new Quaternion().setFromUnitVectors(
      before.clone().normalize(), behind.clone().normalize()), share);
    this.camera.position.copy(before.setLength(distance).applyQuaternion(turn)).add(target);
    this.controls.update();
  }

  /**
   * Returns the target of a view, and the position of its camera.
   * @param {string} name
   * @param {number} time
   */
  viewOf(name, time) {
    for (const part of this.parts) setPlace(part.mesh, part.place, time);
    let box = this.bounds(true);
    if (box.isEmpty()) box = this.bounds(false);
    if (box.isEmpty()) box.set(new Vector3(-1, -1, 0), new Vector3(1, 1, 1));
    const direction = new Vector3(...{
      // the first view in RViz
      cell: [-0.6, 0.7, 0.39], front: [-1, 0, 0.12], side: [0, -1, 0.12],
      top: [-0.001, 0, 1], tools: [-0.6, 0.7, 0.39]}[name]).normalize();
    let radius = 0.5 * box.getSize(new Vector3()).length();
    const center = box.getCenter(new Vector3());
    if (name === 'tools' && this.tools.length > 0) {
      const tools = new Box3();
      for (const [, {place}] of this.tools) {
        tools.expandByPoint(placed(this.places[place], time).at);
      }
      tools.getCenter(center);
      radius = 0.35 + 0.5 * tools.getSize(new Vector3()).length();
    }
    const aspect = Math.min(this.camera.aspect, 1);
    const distance = (this.isFilm ? 1.12 : 0.92) * radius / Math.sin(0.5 * this.camera.fov * Math.PI / 180) / aspect;
    return {center, eye: center.clone().addScaledVector(direction, distance)};
  }

  /** Adapts to the size of the box. */
  resize() {
    const {clientWidth: width, clientHeight: height} = this.box;
    if (width === 0 || height === 0) return;
    const ratio = Math.min(window.devicePixelRatio, this.isFilm ? Infinity
      : Math.sqrt(MOST_PIXELS / (width * height)));
    this.renderer.setPixelRatio(Math.max(ratio, 0.5));
    this.renderer.setSize(width, height);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
  }

  /** Covers the picture with a copy, or removes that: browsers print an older picture of WebGL.
   *  @param {boolean} isStill  right after a draw */
  keepStill(isStill) {
    this.copy?.remove();
    if (!isStill) return;
    const shown = this.renderer.domElement;
    this.copy = document.createElement('canvas');
    this.copy.className = 'copy';
    [this.copy.width, this.copy.height] = [shown.width, shown.height];
    this.copy.getContext('2d')?.drawImage(shown, 0, 0);
    shown.after(this.copy);
  }

  /** @param {number} color */
  setBackground(color) {
    this.scene.background = new Color(color);
  }

  /** @param {number} time  @param {import('./numbers.js').NumberTrack[]} numbers */
  drawLabels(time, numbers) {
    /** @type {Map<string, {at: Vector3, lines: Line[], isBelow?: boolean}>} */
    const blocks = new Map();
    for (const [device, {place, up}] of this.tools) {
      const at = placed(this.places[place], time).at;
      at.addScaledVector(new Vector3(...up), LABEL_ABOVE_M);
      const lines = numbers.filter((it) => it.device === device
        && AT_TOOL.includes(it.quantity)).map((it) => lineOf(it, time));
      blocks.set(device, {at, lines, isBelow: up[2] < 0});
    }
    for (const arrow of this.arrows) {
      if (!arrow.isVariable) continue;  // its number is at the tool
      const number = numbers.find((it) => it.device === arrow.device
        && it.label === arrow.quantity && !AT_TOOL.includes(it.quantity));
      if (number === undefined) continue;
      const key = `${arrow.device} variables`;
      const block = blocks.get(key) ?? {at: arrow.tip.clone(), lines: []};
      block.lines.push(lineOf(number, time));
      blocks.set(key, block);
    }
    for (const it of this.ghost === null ? [] : this.ghost.deviations) {
      if (!it.mesh.visible) continue;
      const block = blocks.get(it.device);
      const line = {text: `Δ ${(1000 * it.length).toFixed(1)} mm`,
        color: this.ghost.style.deviation.slice(0, 3), kind: 'deviation'};
      if (block) block.lines.push(line);
    }
    for (const it of numbers) {
      const {place} = /** @type {any} */ (it);
      if (place !== undefined) addNote(blocks, it, this.places[place], time);
    }
    for (const it of this.objects.shown ?? []) {
      const at = new Vector3(...it.at.slice(0, 3));
      at.z += it.size[2] / 2 + OBJECT_LABEL_M;
      blocks.set(`object ${it.sensor} ${it.number}`, {at, lines: it.text.split('\n').map(
        (/** @type {string} */ text) => ({text, color: it.color, kind: 'object'}))});
    }
    this.placeBlocks(blocks);
  }

  /** @param {Map<string, {at: Vector3, lines: Line[], isBelow?: boolean}>} blocks */
  placeBlocks(blocks) {
    const {clientWidth: width, clientHeight: height} = this.box;
    const views = /** @type {HTMLElement | null} */ (this.box.querySelector('.views'));
    /** @type {number[][]} */
    const taken = [];
    for (const [name, {at, lines, isBelow}] of blocks) {
      let element = this.blocks.get(name);
      if (element === undefined) {
        element = document.createElement('div');
        element.className = 'label';
        this.labels.append(element);
        this.blocks.set(name, element);
      }
      const seen = at.clone().project(this.camera);
      element.hidden = lines.length === 0
        || !(seen.z <= 1 && Math.abs(seen.x) <= 1.05 && Math.abs(seen.y) <= 1.05);
      if (element.hidden) continue;
      const shown = shortened(lines);
      setLines(element, shown);
      const half = element.offsetWidth / 2 + 2;
      const left = Math.min(Math.max((seen.x + 1) / 2 * width, half), Math.max(width - half, half));
      const tall = element.offsetHeight;  // long lines are wrapped
      const meets = (/** @type {number[]} */ [x, halfOther, y, h], /** @type {number} */ top) =>
        Math.abs(x - left) < half + halfOther && top + tall > y && top < y + h;
      let top = (1 - seen.y) / 2 * height - (isBelow ? 0 : tall);
      for (const other of taken) {
        if (meets(other, top)) top = isBelow ? other[2] + other[3] + 2 : other[2] - tall - 2;
      }
      const isBesideViews = views === null || left + half < views.offsetLeft;
      const from = isBesideViews ? this.labelsFrom
        : Math.max(this.labelsFrom, views.offsetTop + views.offsetHeight + 2);
      if (top < from) {  // there is no more room above
        top = from;
        for (const other of [...taken].sort((a, b) => a[2] - b[2])) {
          if (meets(other, top)) top = other[2] + other[3] + 2;
        }
      }
      top = Math.min(top, height - tall - 2);
      taken.push([left, half, top, tall]);
      element.style.transform = `translate(${left.toFixed(0)}px, ${top.toFixed(0)}px)`
        + ' translateX(-50%)';
    }
  }
}

/** The lines of a label that leaves the cell visible; the list beside it has all numbers.
 * @param {Line[]} lines  @returns {Line[]} */
function shortened(lines) {
  if (lines.length <= MOST_LINES) return lines;
  const first = lines.slice(0, MOST_LINES - 1);
  return [...first, {text: `and ${lines.length - first.length} more`,
    color: lines[first.length].color, kind: 'more'}];
}

/** @param {import('./numbers.js').NumberTrack} number  @param {number} time  @returns {Line} */
function lineOf(number, time) {
  const {text, color} = number.at(time);
  return {text, color, kind: number.quantity};
}

/** The box of an object, paler while it is hidden, and the line to the robot.  @param {any} it */
function shapesOf(it) {
  const color = new Color(...it.color);
  const opacity = it.seen ? 1 : 0.5;
  const shape = new BoxGeometry(...it.size.map((/** @type {number} */ edge) => Math.max(edge, 1e-3)));
  const body = new Mesh(shape, new MeshBasicMaterial(
    {color, transparent: true, opacity: 0.3 * opacity, depthWrite: false}));
  const edges = new LineSegments(new EdgesGeometry(shape), new LineBasicMaterial(
    {color, transparent: true, opacity}));
  for (const part of [body, edges]) {
    part.position.set(it.at[0], it.at[1], it.at[2]);
    part.quaternion.set(it.at[3], it.at[4], it.at[5], it.at[6]);
  }
  if (!it.line) return [body, edges];
  const from = new Vector3(...it.line.slice(0, 3));
  const way = new Vector3(...it.line.slice(3)).sub(from);
  const line = new Mesh(new CylinderGeometry(0.5, 0.5, 1, 8).rotateZ(-Math.PI / 2).translate(
    0.5, 0, 0), new MeshBasicMaterial({color, transparent: true, opacity}));
  setArrowShape(line, from, way, way.length(), OBJECT_LINE_M);
  return [body, edges, line];
}

/**
 * Adds the text of a node that has its own place.
 * @param {Map<string, {at: Vector3, lines: Line[]}>} blocks  @param {any} number  @param {any} place
 * @param {number} time
 */
function addNote(blocks, number, place, time) {
  const {text, color} = number.at(time);
  if (!text) return;
  const {at, turn} = placed(place, time);
  at.add(new Vector3(...number.foot).applyQuaternion(turn));
  const key = `${number.quantity} ${number.device}`;
  const block = blocks.get(key) ?? {at, lines: []};
  block.lines.push(...text.split('\n').map(
    (/** @type {string} */ it) => ({text: it, color, kind: number.quantity})));
  blocks.set(key, block);
}

/** @param {HTMLElement} element  @param {Line[]} lines */
function setLines(element, lines) {
  while (element.childElementCount > lines.length) element.lastElementChild?.remove();
  while (element.childElementCount < lines.length) {
    const line = document.createElement('div');
    line.append(document.createElement('i'), document.createElement('span'));
    element.append(line);
  }
  lines.forEach(({text, color, kind}, row) => {
    const line = /** @type {HTMLElement} */ (element.children[row]);
    const [mark, words] = /** @type {any} */ (line.children);
    if (words.textContent !== text) words.textContent = text;
    mark.style.background = cssColor(color);
    line.dataset.kind = kind;
  });
}

const seven = [0, 0, 0, 0, 0, 0, 1];
const three = [0, 0, 0];

/** @param {any} place  @param {number} time */
function placed(place, time) {
  placeAt(place, time, seven);
  return {at: new Vector3(seven[0], seven[1], seven[2]),
    turn: new Quaternion(seven[3], seven[4], seven[5], seven[6])};
}

const ONE = new Vector3(1, 1, 1);

/** @param {any} mesh  @param {any} place  @param {number} time */
function setPlace(mesh, place, time) {
  const {at, turn} = placed(place, time);
  mesh.visible = !Number.isNaN(at.x);  // unknown places of a live cell
  mesh.matrix.compose(at, turn, ONE);
  mesh.matrixWorldNeedsUpdate = true;
}

/** @param {any} arrow  @param {number} time  @param {boolean} isShown */
function setArrow(arrow, time, isShown) {
  const {mesh} = arrow;
  if (arrow.feet !== null) setFootAndColor(arrow, time);
  const foot = placed(arrow.foot, time);
  const at = arrow.offset.clone().applyQuaternion(foot.turn).add(foot.at);
  arrow.tip.copy(at);
  mesh.visible = isShown && arrow.vectorAt(arrow.times, arrow.vectors, time, three);
  if (!mesh.visible) return;
  const vector = new Vector3(...three).applyQuaternion(placed(arrow.frame, time).turn);
  if (arrow.beside > 0) at.addScaledVector(sideways(vector), arrow.beside);
  setArrowShape(mesh, at, vector, vector.length(), arrow.diameter);
  arrow.tip.copy(at).add(vector);
}

/** Updates foot and color of a live arrow.  @param {any} arrow  @param {number} time */
function setFootAndColor(arrow, time) {
  const row = 3 * Math.max(rowAt(arrow.times, time), 0);
  const [x, y, z] = arrow.feet.slice(row, row + 3);
  if (x === undefined || Number.isNaN(x)) return;
  arrow.offset.set(x, y, z);
  const [red, green, blue] = arrow.colors.slice(row, row + 3);
  arrow.mesh.material.color.setRGB(red, green, blue);
  arrow.mesh.material.emissive.copy(arrow.mesh.material.color);
}

/** @param {any} it  @param {number} time  @param {any} style  @param {boolean} isShown */
function setDeviation(it, time, style, isShown) {
  const rows = [0, 0, 0, 0, 0, 0];
  it.mesh.visible = isShown && isWithin(it.shown, time)
    && between(it.times, it.rows, time, rows);
  if (!it.mesh.visible) return;
  const vector = new Vector3(rows[3], rows[4], rows[5]);
  it.length = vector.length();
  it.mesh.visible = it.length >= style.least;
  it.at.set(rows[0], rows[1], rows[2]);
  setArrowShape(it.mesh, it.at, vector, Math.min(style.exaggeration * it.length, style.longest),
    style.diameter);
}

/** A horizontal direction across a vector.  @param {Vector3} vector */
function sideways(vector) {
  const length = Math.hypot(vector.x, vector.y);
  if (length < 1e-3 * vector.length()) return new Vector3(0, 1, 0);
  return new Vector3(-vector.y / length, vector.x / length, 0);
}

/**
 * @param {any} mesh  @param {Vector3} at  @param {Vector3} vector  @param {number} length
 * @param {number} diameter
 */
function setArrowShape(mesh, at, vector, length, diameter) {
  mesh.position.copy(at);
  mesh.quaternion.setFromUnitVectors(X_AXIS, vector.clone().normalize());
  mesh.scale.set(length, diameter, diameter);
}

/** An arrow along x of length 1, whose shaft has the diameter 1 and whose head has 2. */
function arrowGeometry() {
  const shaft = new CylinderGeometry(0.5, 0.5, SHAFT, 12).rotateZ(-Math.PI / 2)
    .translate(SHAFT / 2, 0, 0);
  const head = new ConeGeometry(1, 1 - SHAFT, 16).rotateZ(-Math.PI / 2)
    .translate((1 + SHAFT) / 2, 0, 0);
  const found = new BufferGeometry();
  for (const name of ['position', 'normal']) {
    const parts = [shaft, head].map((it) => it.getAttribute(name).array);
    const joined = new Float32Array(parts[0].length + parts[1].length);
    joined.set(parts[0]);
    joined.set(parts[1], parts[0].length);
    found.setAttribute(name, new BufferAttribute(joined, 3));
  }
  const first = shaft.getAttribute('position').count;
  found.setIndex([...shaft.index.array, ...Array.from(head.index.array, (it) => it + first)]);
  return found;
}
