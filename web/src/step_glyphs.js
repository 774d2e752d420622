// SPDX-License-Identifier: Apache-2.0
/** One sub-step: planes, the proxy's way, what was asked for, what stopped it, leashes and cones of friction. */
import * as THREE from 'three';
import {Lines, onTop, paint} from './ink.js';

const kUp = new THREE.Vector3(0, 1, 0);
const kForward = new THREE.Vector3(0, 0, 1);
const kSize = {plane: 34, from: 4, to: 5, candidate: 5, pull: 5, stop: 9, guard: 5}; // px
const kSlack = 0.1; // of a leash's length: a guard that is nearer is not worth a picture
const kRing = 64; // corners of a circle

const vector = place => new THREE.Vector3(...place);

/** Corners of a circle as pairs of ends. */
function circle(center, radius, across, aside) {
  const at = i => [0, 1, 2].map(axis => center[axis] + radius * (Math.cos(2 * Math.PI * i / kRing) * across[axis] +
                                                                 Math.sin(2 * Math.PI * i / kRing) * aside[axis]));
  return Array.from({length: kRing}, (_, i) => [...at(i), ...at(i + 1)]).flat();
}

/** Ends of the lines through these corners. */
const through = corners => corners.slice(1).flatMap((corner, i) => [...corners[i], ...corner]);

/** The corners of a sub-step's move, scene m. */
export const wayOf = step => step.way_m ?? [step.proxy_m, step.to_m];

/** Whether a leash has a say, or soon may: where mesh and volume agree, the guard is beside the proxy. */
export function isTaut(leash, step) {
  const away_m = Math.hypot(...leash.guard_m.map((v, i) => v - step.proxy_m[i]));
  return leash.plane >= 0 || step.stop?.by === 'leash' || away_m > kSlack * leash.length_m;
}

export class StepGlyphs {
  constructor(toView) {
    this.toView = toView;
    const ball = new THREE.SphereGeometry(1, 16, 12), diamond = new THREE.OctahedronGeometry(1);
    this.disc = new THREE.RingGeometry(0.08, 1, 32);
    this.cone = new THREE.ConeGeometry(1, 1, 40, 1, true);
    this.sphere = new THREE.SphereGeometry(1, 32, 20);
    /** Things of a constant size on screen. */
    this.marks = {from: onTop(new THREE.Mesh(ball, paint('proxy', 0.45)), 12), to: onTop(new THREE.Mesh(ball, paint('proxy')), 15),
                  candidate: onTop(new THREE.Mesh(diamond, paint('plane')), 12), pull: onTop(new THREE.Mesh(diamond, paint('probe')), 12),
                  stop: onTop(new THREE.Mesh(diamond, paint('stop')), 14)};
    this.went = new Lines('proxy', 4, 13);
    this.asked = new Lines('plane', 2, 12);
    this.drawn = new Lines('plane', 1, 11, 0.6);
    this.tethers = new Lines('leash', 2, 11);
    this.rims = new Lines('cone', 2, 11);
    this.lines = [this.went, this.asked, this.drawn, this.tethers, this.rims];
    this.planes = new THREE.Group();
    this.guards = new THREE.Group();
    this.reaches = new THREE.Group();
    this.cones = new THREE.Group();
    this.group = new THREE.Group();
    this.group.add(...this.lines.map(lines => lines.object), ...Object.values(this.marks), this.planes, this.guards, this.reaches,
                   this.cones);
    this.ball = ball;
    this.set(undefined, 0);
  }

  /** Shows sub-step `at` of these, and the way of those before it. */
  set(steps, at) {
    for (const group of [this.planes, this.guards, this.reaches, this.cones]) {
      for (const child of group.children) child.material.dispose();
      group.clear();
    }
    for (const lines of this.lines) lines.set([]);
    this.group.visible = Boolean(steps?.length);
    if (!this.group.visible) return;
    const step = steps[at], view = place => place && this.toView(place);
    this.put('from', view(step.proxy_m));
    this.put('to', view(step.to_m));
    this.put('candidate', view(step.candidate_m));
    this.put('pull', view(step.pull_m));
    this.put('stop', view(step.stop?.at_m));
    this.went.set(steps.slice(0, at + 1).flatMap(one => through(wayOf(one).map(view))));
    const from = view(step.proxy_m);
    this.asked.set([...from, ...view(step.wanted_m)]);
    this.drawn.set([...from, ...view(step.candidate_m)]);
    this.setPlanes(step);
    this.setLeashes(step);
    this.setCones(step);
  }

  put(name, place) {
    const mark = this.marks[name];
    mark.visible = Boolean(place?.every(Number.isFinite));
    if (mark.visible) mark.position.set(...place);
  }

  setPlanes(step) {
    const leashed = new Set((step.leashes ?? []).map(leash => leash.plane));
    (step.planes ?? []).forEach((plane, i) => {
      const mesh = onTop(new THREE.Mesh(this.disc, paint(leashed.has(i) ? 'leash' : 'plane', plane.active ? 0.45 : 0.15)), 10);
      // A disc where the proxy's foot is on the plane: the plane's own point may be far away.
      const normal = vector(plane.normal).normalize(), at = vector(this.toView(plane.at_m));
      mesh.position.copy(vector(this.toView(step.proxy_m)));
      mesh.position.addScaledVector(normal, at.sub(mesh.position).dot(normal));
      mesh.quaternion.setFromUnitVectors(kForward, normal);
      this.planes.add(mesh);
    });
  }

  /** The guard, how far the leash reaches from it, and the leash from the guard to the proxy. */
  setLeashes(step) {
    const lines = [];
    for (const leash of (step.leashes ?? []).filter(one => isTaut(one, step))) {
      const at = this.toView(leash.guard_m), radius = 1000 * leash.length_m;
      const guard = onTop(new THREE.Mesh(this.ball, paint('leash')), 13);
      const reach = onTop(new THREE.Mesh(this.sphere, paint('leash', 0.08)), 9);
      guard.position.set(...at);
      reach.position.set(...at);
      reach.scale.setScalar(radius);
      this.guards.add(guard);
      this.reaches.add(reach);
      lines.push(...at, ...this.toView(step.proxy_m));
      for (const [across, aside] of [[[1, 0, 0], [0, 1, 0]], [[0, 1, 0], [0, 0, 1]], [[0, 0, 1], [1, 0, 0]]])
        lines.push(...circle(at, radius, across, aside));
    }
    this.tethers.set(lines);
  }

  /** What draws the proxy may lie in the cone before friction slips. Forces in N are lengths by the stiffness that draws it. */
  setCones(step) {
    const rims = [];
    for (const friction of step.friction ?? []) {
      const height = 1000 * friction.normal_n / step.stiffness_n_per_m, radius = 1000 * friction.most_n / step.stiffness_n_per_m;
      if (!(height > 0) || !(radius > 0)) continue;
      const cone = onTop(new THREE.Mesh(this.cone, paint('cone', friction.holds ? 0.35 : 0.18)), 9);
      const axis = vector(friction.axis).normalize(), apex = vector(this.toView(friction.apex_m));
      cone.position.copy(apex).addScaledVector(axis, -height / 2);
      cone.quaternion.setFromUnitVectors(kUp, axis);
      cone.scale.set(radius, height, radius);
      this.cones.add(cone);
      const across = new THREE.Vector3(1, 0, 0).applyQuaternion(cone.quaternion);
      const aside = new THREE.Vector3(0, 0, 1).applyQuaternion(cone.quaternion);
      const foot = apex.addScaledVector(axis, -height);
      rims.push(...circle(foot.toArray(), radius, across.toArray(), aside.toArray()));
    }
    this.rims.set(rims);
  }

  /** Sizes that stay the same on the screen. */
  setScale(mmPerPixel) {
    for (const [name, mark] of Object.entries(this.marks)) mark.scale.setScalar(kSize[name] * mmPerPixel);
    for (const plane of this.planes.children) plane.scale.setScalar(kSize.plane * mmPerPixel);
    for (const guard of this.guards.children) guard.scale.setScalar(kSize.guard * mmPerPixel);
  }
}
