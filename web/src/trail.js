// SPDX-License-Identifier: Apache-2.0
/** The proxy's path, coloured by force or by structure. */
import * as THREE from 'three';
import {LineMaterial} from 'three/addons/lines/LineMaterial.js';
import {LineSegments2} from 'three/addons/lines/LineSegments2.js';
import {LineSegmentsGeometry} from 'three/addons/lines/LineSegmentsGeometry.js';
import {forceColor, hexColor} from './colors.js';
import {feltOf} from './words.js';

// More are not told apart; without a graphics card, each costs as much as 15 facets.
const kSegments = {card: 4000, program: 1000};
const kSame_mm = 0.01; // what moved by less is where it was
const kHiddenOpacity = 0.3; // of what surfaces cover

export class Trail {
  constructor(scene, toView, isSoftware) {
    this.scene = scene;
    this.segmentsAtMost = isSoftware ? kSegments.program : kSegments.card;
    this.isSoftware = isSoftware;
    this.toView = toView;
    this.group = new THREE.Group();
    const material = options => new LineMaterial({vertexColors: true, linewidth: 3, ...options});
    this.materials = [
      material({depthTest: false, transparent: true, opacity: kHiddenOpacity}), material({}),
    ];
    this.lines = this.materials.map((one, i) => {
      const line = new LineSegments2(new LineSegmentsGeometry(), one);
      line.frustumCulled = false;
      line.renderOrder = i;
      this.group.add(line);
      return line;
    });
  }

  setResolution(width, height) {
    for (const material of this.materials) material.resolution.set(width, height);
  }

  /** While something moves, a program draws what surfaces cover without the path behind them. */
  setMoving(isMoving) {
    this.lines[0].visible = !(isMoving && this.isSoftware);
  }

  /** Frames [begin, end] that are shown for "1", "5", "now" and "all". */
  range(frames, index, span) {
    if (span === 'off' || frames.count < 2) return [0, 0];
    if (span === 'all') return [0, frames.count - 1];
    if (span === 'now') return [0, index];
    return [frames.at(frames.columns.time_s[index] - Number(span)), index];
  }

  colorOf(frames, i, by, scale_n) {
    const felt = frames.columns.felt[i];
    if (felt === 0) return [0.55, 0.6, 0.66];
    if (by === 'force') return forceColor(frames.force(i) / scale_n);
    return hexColor(feltOf(this.scene, felt)[0]?.color);
  }

  /**
   * Draws the path anew; true where it looks different.
   * @param {import('./frames.js').FrameStore} frames
   */
  update(frames, index, {span, by}, scale_n) {
    const [begin, end] = this.range(frames, index, span);
    const stride = Math.max(1, Math.ceil((end - begin) / this.segmentsAtMost));
    const places = [], colors = [];
    const color = new THREE.Color();
    const {trial} = frames.columns;
    let before, last = begin; // the frame of the place before
    // Whole strides from the first frame, so that the path does not crawl while it grows.
    for (let i = Math.ceil(begin / stride) * stride; i <= end; i += stride) {
      const place = this.toView(frames.columns.proxy_m.subarray(3 * i, 3 * i + 3));
      const isWhole = place.every(Number.isFinite);
      if (trial[i] !== trial[last]) before = undefined; // a trial begins elsewhere
      last = i;
      if (isWhole && before && Math.hypot(...place.map((v, axis) => v - before[axis])) <= kSame_mm) continue; // it rests
      if (isWhole && before) {
        color.setRGB(...this.colorOf(frames, i, by, scale_n), THREE.SRGBColorSpace);
        places.push(...before, ...place);
        colors.push(color.r, color.g, color.b, color.r, color.g, color.b);
      }
      before = isWhole ? place : undefined;
    }
    const paint = `${by} ${scale_n}`;
    const isNew = paint !== this.paint || places.length !== this.places?.length || places.some((v, i) => Math.abs(v - this.places[i]) > kSame_mm);
    if (!isNew) return false;
    this.places = places;
    this.paint = paint;
    this.segments = places.length / 6;
    this.group.visible = this.segments > 0;
    if (!this.group.visible) return true;
    const geometry = new LineSegmentsGeometry();
    geometry.setPositions(places);
    geometry.setColors(colors);
    this.lines[0].geometry.dispose();
    for (const line of this.lines) line.geometry = geometry;
    return true;
  }
}
