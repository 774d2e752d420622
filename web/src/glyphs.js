// SPDX-License-Identifier: Apache-2.0
/** Probe, proxy, spring, force, contact planes and points: small things of a constant size on screen. */
import * as THREE from 'three';
import {LineMaterial} from 'three/addons/lines/LineMaterial.js';
import {LineSegments2} from 'three/addons/lines/LineSegments2.js';
import {LineSegmentsGeometry} from 'three/addons/lines/LineSegmentsGeometry.js';
import {hexColor} from './colors.js';

const kUp = new THREE.Vector3(0, 1, 0);
const kForward = new THREE.Vector3(0, 0, 1);
/** Colours that the legend has too. */
export const kGlyphColors = {probe: '#3373c8', proxy: '#dc720c', force: '#d02d78', spring: '#666600',
                             mark: '#00a184', plane: '#5b34b0'};
const kSize = {probe: 7, proxy: 6, shaft: 2, head: 6, headLength: 15, plane: 34}; // px

function paint(name, opacity = 1) {
  return new THREE.MeshBasicMaterial({
    color: new THREE.Color().setRGB(...hexColor(kGlyphColors[name]), THREE.SRGBColorSpace),
    depthTest: false, transparent: true, opacity, side: THREE.DoubleSide,
  });
}

function onTop(object, order) {
  object.renderOrder = order;
  object.frustumCulled = false;
  return object;
}

/** Thick lines in one colour. */
class Lines {
  constructor(name, width) {
    this.material = new LineMaterial({color: new THREE.Color().setRGB(...hexColor(kGlyphColors[name]),
      THREE.SRGBColorSpace), linewidth: width, depthTest: false, transparent: true});
    this.object = onTop(new LineSegments2(new LineSegmentsGeometry(), this.material), 11);
  }

  /** @param {number[]} places x, y, z of both ends of each line */
  set(places) {
    this.object.visible = places.length > 0;
    if (places.length === 0) return;
    const geometry = new LineSegmentsGeometry();
    geometry.setPositions(places);
    this.object.geometry.dispose();
    this.object.geometry = geometry;
  }
}

export class Glyphs {
  constructor(scene, toView) {
    this.toView = toView;
    this.probeRadius = 1000 * (scene.probe?.radius_m ?? 0);
    this.group = new THREE.Group();
    const ball = new THREE.SphereGeometry(1, 16, 12);
    this.probe = onTop(new THREE.Mesh(ball, paint('probe', 0.9)), 12);
    this.proxy = onTop(new THREE.Mesh(ball, paint('proxy')), 13);
    this.spring = new Lines('spring', 2.5);
    this.chords = new Lines('plane', 2);
    this.arrow = new THREE.Group();
    this.shaft = onTop(new THREE.Mesh(new THREE.CylinderGeometry(1, 1, 1, 10), paint('force')), 14);
    this.head = onTop(new THREE.Mesh(new THREE.ConeGeometry(1, 1, 14), paint('force')), 14);
    this.arrow.add(this.shaft, this.head);
    this.planes = new THREE.Group();
    this.marks = new THREE.Group();
    this.group.add(this.probe, this.proxy, this.spring.object, this.chords.object, this.arrow,
                   this.planes, this.marks);
    this.tip = new THREE.Vector3();
    this.direction = new THREE.Vector3();
    this.chords.set([]);
    this.group.visible = false; // until there is a frame
  }

  setResolution(width, height) {
    for (const lines of [this.spring, this.chords]) lines.material.resolution.set(width, height);
  }

  /** The frame that is shown; places in the page's frame, mm. */
  setFrame(probe, proxy, force_n, scale_n) {
    const isWhole = [...probe, ...proxy].every(Number.isFinite);
    this.group.visible = isWhole;
    if (!isWhole) return;
    this.probe.position.set(...probe);
    this.proxy.position.set(...proxy);
    this.spring.set([...probe, ...proxy]);
    this.force_n = Math.hypot(...force_n);
    this.share = Math.min(1, this.force_n / scale_n);
    if (this.force_n > 0) this.direction.set(...force_n).normalize();
  }

  /** Sizes that stay the same on the screen. */
  setScale(mmPerPixel, reach_mm) {
    this.probe.scale.setScalar(Math.max(kSize.probe * mmPerPixel, this.probeRadius));
    this.proxy.scale.setScalar(kSize.proxy * mmPerPixel);
    for (const plane of this.planes.children) plane.scale.setScalar(kSize.plane * mmPerPixel);
    for (const mark of this.marks.children) mark.scale.setScalar(kSize.proxy * mmPerPixel);
    const head = kSize.headLength * mmPerPixel, shaft = (this.share ?? 0) * reach_mm;
    this.arrow.visible = shaft > mmPerPixel; // less than a pixel would be all head
    if (!this.arrow.visible) return;
    this.arrow.position.copy(this.proxy.position);
    this.arrow.quaternion.setFromUnitVectors(kUp, this.direction);
    this.shaft.scale.set(kSize.shaft * mmPerPixel, shaft, kSize.shaft * mmPerPixel);
    this.shaft.position.y = shaft / 2;
    this.head.scale.set(kSize.head * mmPerPixel, head, kSize.head * mmPerPixel);
    this.head.position.y = shaft + head / 2;
    this.tip.copy(this.proxy.position).addScaledVector(this.direction, shaft + head);
  }

  /** Contact planes of one sub-step, and the proxy's way up to it. */
  setDetail(steps, at) {
    this.planes.clear();
    this.chords.set([]);
    if (!steps?.length) return;
    const disc = new THREE.RingGeometry(0.08, 1, 32);
    for (const plane of steps[at].planes ?? []) {
      const mesh = onTop(new THREE.Mesh(disc, paint('plane', plane.active ? 0.5 : 0.15)), 10);
      mesh.position.set(...this.toView(plane.at_m));
      mesh.quaternion.setFromUnitVectors(kForward, new THREE.Vector3(...plane.normal).normalize());
      this.planes.add(mesh);
    }
    const ways = [];
    for (let i = 1; i <= at; ++i)
      ways.push(...this.toView(steps[i - 1].proxy_m), ...this.toView(steps[i].proxy_m));
    if (steps[at].candidate_m)
      ways.push(...this.toView(steps[at].proxy_m), ...this.toView(steps[at].candidate_m));
    this.chords.set(ways);
  }

  setMarks(marks) {
    this.marks.clear();
    const shape = new THREE.OctahedronGeometry(1);
    for (const mark of marks) {
      const mesh = onTop(new THREE.Mesh(shape, paint('mark')), 11);
      mesh.position.set(...this.toView(mark.at_m));
      this.marks.add(mesh);
    }
  }
}
