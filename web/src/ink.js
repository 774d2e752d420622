// SPDX-License-Identifier: Apache-2.0
/** What small things are drawn with: one colour each, on top of all surfaces. */
import * as THREE from 'three';
import {LineMaterial} from 'three/addons/lines/LineMaterial.js';
import {LineSegments2} from 'three/addons/lines/LineSegments2.js';
import {LineSegmentsGeometry} from 'three/addons/lines/LineSegmentsGeometry.js';
import {hexColor} from './colors.js';

/** Colours that the legend has too. */
export const kGlyphColors = {probe: '#3373c8', proxy: '#dc720c', force: '#d02d78', spring: '#666600',
                             mark: '#00a184', plane: '#5b34b0', stop: '#c8102e', leash: '#00808c', cone: '#b08000', edge: '#20262c'};

const colorOf = name => new THREE.Color().setRGB(...hexColor(kGlyphColors[name]), THREE.SRGBColorSpace);

export function paint(name, opacity = 1) {
  return new THREE.MeshBasicMaterial({color: colorOf(name), depthTest: false, transparent: true, opacity,
                                      side: THREE.DoubleSide});
}

export function onTop(object, order) {
  object.renderOrder = order;
  object.frustumCulled = false;
  return object;
}

/** Thick lines in one colour. */
export class Lines {
  constructor(name, width, order = 11, opacity = 1) {
    this.material = new LineMaterial({color: colorOf(name), linewidth: width, depthTest: false, transparent: true, opacity});
    this.object = onTop(new LineSegments2(new LineSegmentsGeometry(), this.material), order);
    this.set([]);
  }

  /** @param {number[]} places x, y, z of both ends of each line */
  set(places) {
    this.places = places;
    this.object.visible = places.length > 0;
    if (places.length === 0) return;
    const geometry = new LineSegmentsGeometry();
    geometry.setPositions(places);
    this.object.geometry.dispose();
    this.object.geometry = geometry;
  }
}
