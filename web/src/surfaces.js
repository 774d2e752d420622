// SPDX-License-Identifier: Apache-2.0
/** The structures' surfaces: levels of detail, colours, transparency, cuts and what is painted on. */
import * as THREE from 'three';
import {areaCoverage, vertexCoverage} from './coverage.js';
import {forceColor, hexColor, kTouchedShare} from './colors.js';
import {DamagedData} from './container.js';

const kQuantum = 65535; // positions are 16 bits in the box
const kGlow = 0.45; // of its own colour, where a structure is selected
const kCoverageFacets = 150000; // at most, of the level on which areas are measured

/** Positions in the page's frame (mm from the scene's centre) and corners of one level. */
function readLevel(level, box, blob, toView) {
  const positions = blob(level.positions, undefined, 'u16');
  const indices = blob(level.indices, undefined, 'u32');
  if (positions.length % 3 || indices.length % 3)
    throw new DamagedData(`A surface has ${positions.length} coordinates and ${indices.length} corners.`);
  const vertices = positions.length / 3;
  for (const index of indices)
    if (index >= vertices)
      throw new DamagedData(`A surface has corner ${index} of ${vertices} vertices.`);
  const [low, high] = [toView(box[0]), toView(box[1])];
  const places = new Float32Array(positions.length);
  for (let i = 0; i < positions.length; ++i) {
    const axis = i % 3;
    places[i] = low[axis] + (high[axis] - low[axis]) * positions[i] / kQuantum;
  }
  return {places, indices};
}

class Level {
  constructor(description) {
    this.facets = description.facets;
    this.description = description;
    this.isHere = description.positions !== undefined; // else it can be asked for
  }

  load(box, blob, toView) {
    this.make = () => {
      const {places, indices} = readLevel(this.description, box, blob, toView);
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute('position', new THREE.BufferAttribute(places, 3));
      geometry.setIndex(new THREE.BufferAttribute(indices, 1));
      geometry.computeVertexNormals();
      geometry.computeBoundingSphere();
      return geometry;
    };
    this.isHere = true;
  }

  get geometry() {
    return this.made ??= this.make();
  }
}

/** One structure and how it is shown. */
class Surface {
  constructor(structure, blob, toView, radius_mm) {
    this.structure = structure;
    this.toView = toView;
    this.radius_mm = radius_mm;
    this.color = new THREE.Color().setRGB(...hexColor(structure.color), THREE.SRGBColorSpace);
    this.material = new THREE.MeshLambertMaterial({
      color: this.color, side: THREE.DoubleSide, polygonOffset: true, polygonOffsetFactor: 1,
      polygonOffsetUnits: 1,
    });
    this.mesh = new THREE.Mesh(new THREE.BufferGeometry(), this.material);
    this.mesh.name = structure.name;
    this.levels = [];
    this.box = structure.box_m;
    this.isShown = true;
    this.isCut = true;
    for (const level of structure.levels ?? []) this.add(level, blob);
    this.announce(structure.facets_most ?? 0);
    this.show(0);
  }

  /** Levels that can be asked for, each four times the one before, up to the finest of all. */
  announce(most) {
    if (this.levels.length === 0) return;
    for (let facets = 4 * this.levels.at(-1).facets; facets < most; facets *= 4) this.levels.push(new Level({facets}));
    if (this.levels.at(-1).facets < most) this.levels.push(new Level({facets: most}));
  }

  /** Adds a level, or fills in one that was only announced. */
  add(description, blob) {
    let level = this.levels.find(known => known.facets === description.facets);
    if (!level) {
      level = new Level(description);
      this.levels.push(level);
      this.levels.sort((a, b) => a.facets - b.facets);
    }
    level.description = description;
    if (description.positions !== undefined) level.load(this.box, blob, this.toView);
  }

  /** Takes the surface of another choice in the place of its own. */
  replace(structure, blob) {
    for (const level of this.levels) level.made?.dispose();
    this.levels = [];
    this.level = undefined;
    this.aimed = undefined;
    this.area = undefined;
    this.box = structure.box_m;
    for (const level of structure.levels) this.add(level, blob);
    if (this.levels.length === 0) this.mesh.geometry = new THREE.BufferGeometry();
    this.show(0);
  }

  get facets() {
    return this.level?.facets ?? 0;
  }

  /** What was asked for has come, with as many facets as it has. */
  leaveAsked() {
    this.levels = this.levels.filter(level => level.isHere || !level.isAsked);
  }

  get finest() {
    return this.levels.filter(level => level.isHere).length - 1;
  }

  show(index) {
    const here = this.levels.filter(level => level.isHere);
    if (here.length === 0) return;
    this.level = here[Math.min(index, here.length - 1)];
    this.mesh.geometry = this.level.geometry;
  }

  setOpacity(opacity) {
    this.material.opacity = opacity;
    this.material.transparent = opacity < 1;
    this.material.depthWrite = opacity === 1;
    this.material.needsUpdate = true;
    this.mesh.visible = this.isShown && opacity > 0;
  }

  setShown(isShown) {
    this.isShown = isShown;
    this.mesh.visible = isShown && this.material.opacity > 0;
  }

  /** Brighter than the light makes it. */
  setSelected(isSelected) {
    this.material.emissive.copy(this.color).multiplyScalar(isSelected ? kGlow : 0);
  }

  /** What a pointer's ray is tried on: the coarsest level, which no picture has. */
  get target() {
    const coarsest = this.levels.find(level => level.isHere);
    if (coarsest && !this.aimed) this.aimed = new THREE.Mesh(coarsest.geometry, this.material);
    return this.aimed;
  }

  setPlanes(planes) {
    this.material.clippingPlanes = this.isCut ? planes : [];
  }

  /** What is painted on a level, made when it is first asked for. */
  paintOf(level) {
    if (!level.coverage) {
      level.coverage = vertexCoverage(level.geometry, this.radius_mm);
      if (this.hasForgotten && this.memory !== level.coverage) level.coverage.takeFrom(this.memory);
    }
    return level.coverage;
  }

  /** What was touched since the page is open: on the coarsest level, so that it costs little. */
  get memory() {
    const coarsest = this.levels.find(level => level.isHere);
    return coarsest && this.paintOf(coarsest);
  }

  /** Frames go. What is not painted now would miss them: it is made from the memory when it is wanted again. */
  forgetFrames(isPainted) {
    this.hasForgotten = true;
    const coarsest = this.levels.find(level => level.isHere);
    for (const level of this.levels)
      if (level !== coarsest && !(isPainted && level === this.level)) level.coverage = undefined;
  }

  /** The share of the area that was felt: of one level, so that the detail drawn does not change it. */
  get coverage() {
    const here = this.levels.filter(level => level.isHere);
    return this.area ??= here.length
      ? areaCoverage((here.filter(level => level.facets <= kCoverageFacets).at(-1) ?? here[0]).geometry, this.radius_mm)
      : undefined;
  }

  /** All that takes in frames. */
  get coverages() {
    return [this.area, ...this.levels.map(level => level.coverage)].filter(Boolean);
  }

  /**
   * Paints what was felt, from the frames so far.
   * @param {'none' | 'touched' | 'longest' | 'hardest'} kind
   * @param {{longest: number, hardest: number}} most what has the last colour
   */
  paint(kind, most) {
    const geometry = this.mesh.geometry;
    const isPainted = kind !== 'none' && this.structure.bit >= 0 && this.level;
    if (isPainted) {
      const coverage = this.paintOf(this.level);
      const colors = this.level.colors ??= new Float32Array(3 * coverage.count);
      const paper = [this.color.r, this.color.g, this.color.b];
      const paints = Array.from({length: 65}, (_, i) => {
        const made = new THREE.Color().setRGB(...forceColor(i / 64), THREE.SRGBColorSpace);
        return [made.r, made.g, made.b];
      });
      const values = kind === 'longest' ? coverage.time_s : coverage.force_n;
      for (let v = 0; v < coverage.count; ++v) {
        const share = kind === 'touched' ? kTouchedShare : Math.min(1, values[v] / most[kind]);
        colors.set(coverage.isTouched[v] ? paints[Math.round(64 * share)] : paper, 3 * v);
      }
      if (!geometry.getAttribute('color'))
        geometry.setAttribute('color', new THREE.BufferAttribute(colors, 3));
      geometry.getAttribute('color').needsUpdate = true;
    }
    if (this.material.vertexColors !== Boolean(isPainted)) {
      this.material.vertexColors = Boolean(isPainted);
      this.material.needsUpdate = true;
    }
    this.material.color.copy(isPainted ? new THREE.Color(1, 1, 1) : this.color);
  }
}

/** All structures of the scene. */
export class Surfaces {
  constructor(scene, blob, toView) {
    const radius_mm = 1000 * (scene.probe?.radius_m ?? 0);
    this.all = (scene.structures ?? []).map(s => new Surface(s, blob, toView, radius_mm));
    this.group = new THREE.Group();
    for (const surface of this.all) this.group.add(surface.mesh);
    this.budget = 0;
  }

  byId(id) {
    return this.all.find(surface => surface.structure.id === id);
  }

  get facets() {
    return this.all.reduce((sum, s) => sum + (s.mesh.visible ? s.facets : 0), 0);
  }

  /** Facets of the finest levels that there are, here or with the loop. */
  get mostFacets() {
    return this.all.reduce((sum, s) => sum + (s.mesh.visible ? s.levels.at(-1)?.facets ?? 0 : 0), 0);
  }

  /** Chooses levels: from the coarsest, the cheapest step to a finer one while facets are left. */
  chooseLevels(budget) {
    const seen = this.all.filter(s => s.mesh.visible && s.finest >= 0);
    const chosen = new Map(seen.map(s => [s, 0]));
    const here = s => s.levels.filter(level => level.isHere);
    let sum = seen.reduce((total, s) => total + here(s)[0].facets, 0);
    for (;;) {
      const steps = seen.filter(s => chosen.get(s) < s.finest)
        .map(s => ({s, cost: here(s)[chosen.get(s) + 1].facets - here(s)[chosen.get(s)].facets}))
        .sort((a, b) => a.cost - b.cost);
      if (steps.length === 0 || sum + steps[0].cost > budget) break;
      sum += steps[0].cost;
      chosen.set(steps[0].s, chosen.get(steps[0].s) + 1);
    }
    let isChanged = false;
    for (const [surface, index] of chosen) {
      const before = surface.level;
      surface.show(index);
      isChanged ||= before !== surface.level;
    }
    return isChanged;
  }

  /** The finer level to be asked for next, so that the finest of all have at most so many facets: the smallest first. */
  wanted(most) {
    const seen = this.all.filter(s => s.mesh.visible && s.levels.length > 0);
    const held = s => s.levels.filter(level => level.isHere).at(-1)?.facets ?? 0;
    const spare = most - seen.reduce((sum, s) => sum + held(s), 0);
    const steps = seen.map(surface => ({surface, level: surface.levels.find(level => !level.isHere && !level.isAsked)}))
      .filter(({surface, level}) => level && level.facets - held(surface) <= spare);
    return steps.sort((a, b) => a.level.facets - b.level.facets)[0];
  }

  /** What was asked for will not come: it can be asked for again. */
  forgetAsked() {
    for (const level of this.all.flatMap(s => s.levels)) level.isAsked = false;
  }
}
