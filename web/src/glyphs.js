// SPDX-License-Identifier: Apache-2.0
/** Probe, proxy, spring, force, sub-steps and points: small things of a constant size on screen. */
import * as THREE from 'three';
import {Lines, onTop, paint} from './ink.js';
import {StepGlyphs} from './step_glyphs.js';

export {kGlyphColors} from './ink.js';

const kUp = new THREE.Vector3(0, 1, 0);
const kSize = {probe: 7, proxy: 6, shaft: 2, head: 6, headLength: 15}; // px

export class Glyphs {
  constructor(scene, toView) {
    this.toView = toView;
    this.probeRadius = 1000 * (scene.probe?.radius_m ?? 0);
    this.group = new THREE.Group();
    const ball = new THREE.SphereGeometry(1, 16, 12);
    this.probe = onTop(new THREE.Mesh(ball, paint('probe', 0.9)), 12);
    this.proxy = onTop(new THREE.Mesh(ball, paint('proxy')), 13);
    this.spring = new Lines('spring', 2.5);
    this.arrow = new THREE.Group();
    this.shaft = onTop(new THREE.Mesh(new THREE.CylinderGeometry(1, 1, 1, 10), paint('force')), 14);
    this.head = onTop(new THREE.Mesh(new THREE.ConeGeometry(1, 1, 14), paint('force')), 14);
    this.arrow.add(this.shaft, this.head);
    this.steps = new StepGlyphs(toView);
    this.marks = new THREE.Group();
    this.group.add(this.probe, this.proxy, this.spring.object, this.arrow, this.steps.group, this.marks);
    this.tip = new THREE.Vector3();
    this.direction = new THREE.Vector3();
    this.group.visible = false; // until there is a frame
  }

  setResolution(width, height) {
    for (const lines of [this.spring, ...this.steps.lines]) lines.material.resolution.set(width, height);
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

  /** Sub-step `at` of these; before the last one there is no proxy of the frame yet, and no force. */
  setSteps(steps, at) {
    this.isMidway = Boolean(steps) && at + 1 < steps.length;
    this.proxy.visible = !this.isMidway;
    this.spring.object.visible = !this.isMidway;
    this.steps.set(steps, at);
  }

  /** Sizes that stay the same on the screen. */
  setScale(mmPerPixel, reach_mm) {
    this.probe.scale.setScalar(Math.max(kSize.probe * mmPerPixel, this.probeRadius));
    this.proxy.scale.setScalar(kSize.proxy * mmPerPixel);
    this.steps.setScale(mmPerPixel);
    for (const mark of this.marks.children) mark.scale.setScalar(kSize.proxy * mmPerPixel);
    const head = kSize.headLength * mmPerPixel, shaft = (this.share ?? 0) * reach_mm;
    this.arrow.visible = shaft > mmPerPixel && !this.isMidway; // less than a pixel would be all head
    if (!this.arrow.visible) return;
    this.arrow.position.copy(this.proxy.position);
    this.arrow.quaternion.setFromUnitVectors(kUp, this.direction);
    this.shaft.scale.set(kSize.shaft * mmPerPixel, shaft, kSize.shaft * mmPerPixel);
    this.shaft.position.y = shaft / 2;
    this.head.scale.set(kSize.head * mmPerPixel, head, kSize.head * mmPerPixel);
    this.head.position.y = shaft + head / 2;
    this.tip.copy(this.proxy.position).addScaledVector(this.direction, shaft + head);
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
