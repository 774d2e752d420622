// SPDX-License-Identifier: Apache-2.0
/** The three-dimensional view: camera, light, cut, and drawing only when something changed. */
import * as THREE from 'three';
import {OrbitControls} from 'three/addons/controls/OrbitControls.js';
import {CutEdge} from './cut_edge.js';
import {Glyphs} from './glyphs.js';
import {Pace} from './pace.js';
import {SlicePlanes} from './slice_planes.js';
import {Surfaces} from './surfaces.js';
import {Trail} from './trail.js';
import {styleColor} from './colors.js';

const kFieldOfView = 30; // degrees
const kReach = 0.2; // of the view's height: the arrow of the greatest force
const kStillAfter_ms = 500;
const kTurn = Math.PI / 36; // of one press of an arrow key

/** Name of what draws, and whether it is a program instead of a graphics card. */
function drawer() {
  const gl = document.createElement('canvas').getContext('webgl2');
  if (!gl) return undefined;
  const info = gl.getExtension('WEBGL_debug_renderer_info');
  const name = info ? gl.getParameter(info.UNMASKED_RENDERER_WEBGL) : gl.getParameter(gl.RENDERER);
  gl.getExtension('WEBGL_lose_context')?.loseContext();
  return {name, isSoftware: /swiftshader|llvmpipe|software|basic render/i.test(name)};
}

export class View3d {
  /**
   * @param {HTMLElement} host
   * @param {any} scene
   * @param {(name: string, count?: number, type?: string) => any} blob
   * @param {boolean} isPosed each picture may take its time
   */
  constructor(host, scene, blob, isPosed = false) {
    this.host = host;
    this.isPosed = isPosed;
    this.center = scene.view?.center_m ?? [0, 0, 0];
    this.radius = 1000 * (scene.view?.radius_m || 0.1);
    /** Scene m to the page's mm from the centre: single precision is enough there. */
    this.toView = place => [0, 1, 2].map(i => 1000 * (place[i] - this.center[i]));
    this.fromView = place => [place.x, place.y, place.z].map((v, i) => v / 1000 + this.center[i]);
    this.surfaces = new Surfaces(scene, blob, this.toView);
    this.glyphs = new Glyphs(scene, this.toView);
    this.planes = new SlicePlanes(this.toView);
    this.makeRenderer();
    this.trail = new Trail(scene, this.toView, this.drawer.isSoftware && !isPosed);
    this.pace = new Pace(this.drawer.isSoftware);
    this.makeScene();
    this.makeCamera();
    this.observer = new ResizeObserver(() => this.resize());
    this.observer.observe(host);
    this.resize();
    this.retheme();
  }

  makeRenderer() {
    this.drawer = drawer();
    if (!this.drawer)
      throw new Error('This browser has no WebGL 2, which draws the surfaces: take a newer one, or switch it on.');
    this.renderer = new THREE.WebGLRenderer({antialias: this.isPosed || !this.drawer.isSoftware});
    this.renderer.localClippingEnabled = true;
    this.canvas = this.renderer.domElement;
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute('role', 'application');
    this.canvas.setAttribute('aria-label', 'Surfaces, probe and proxy. Arrow keys turn the view, plus and minus zoom.');
    this.host.prepend(this.canvas);
  }

  makeScene() {
    this.scene = new THREE.Scene();
    this.cutEdge = new CutEdge();
    this.scene.add(this.surfaces.group, this.planes.group, this.trail.group, this.glyphs.group, this.cutEdge.object);
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x666a70, 1.8));
    this.cut = new THREE.Plane();
    this.isCut = false;
  }

  makeCamera() {
    this.camera = new THREE.PerspectiveCamera(kFieldOfView, 1, 1, 1000);
    this.camera.up.set(0, 0, 1);
    const lamp = new THREE.DirectionalLight(0xffffff, 1.5);
    lamp.position.set(-0.4, 0.6, 1);
    this.camera.add(lamp);
    this.scene.add(this.camera);
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.enableDamping = false;
    this.controls.addEventListener('change', () => this.touch());
    this.lookFrom([-0.5, -0.75, 0.35]); // the front, from the right and above
  }

  /** Looks at the scene's centre from a direction (scene axes). */
  lookFrom(direction) {
    const away = 0.92 * this.radius / Math.sin(THREE.MathUtils.degToRad(kFieldOfView / 2)) /
                 Math.min(1, this.camera.aspect);
    const from = new THREE.Vector3(...direction).normalize();
    if (Math.abs(from.z) > 0.999) from.set(0, -0.001, Math.sign(from.z)).normalize(); // keep "up" known
    this.controls.target.set(0, 0, 0);
    this.camera.position.copy(from.multiplyScalar(away));
    this.controls.update();
    this.touch();
  }

  turn(aside, up) {
    const offset = this.camera.position.clone().sub(this.controls.target);
    const round = new THREE.Spherical().setFromVector3(offset.applyQuaternion(kZUpToYUp));
    round.theta += aside * kTurn;
    round.phi = THREE.MathUtils.clamp(round.phi - up * kTurn, 0.01, Math.PI - 0.01);
    offset.setFromSpherical(round).applyQuaternion(kYUpToZUp);
    this.camera.position.copy(this.controls.target).add(offset);
    this.controls.update();
    this.touch();
  }

  zoom(factor) {
    const offset = this.camera.position.clone().sub(this.controls.target).multiplyScalar(factor);
    this.camera.position.copy(this.controls.target).add(offset);
    this.controls.update();
    this.touch();
  }

  /** Moves the view's centre to a place (scene m) and keeps the direction and distance. */
  centerOn(place_m) {
    const target = new THREE.Vector3(...this.toView(place_m));
    this.camera.position.add(target.clone().sub(this.controls.target));
    this.controls.target.copy(target);
    this.controls.update();
    this.touch();
  }

  /** Fills the view with a ball about a place (scene m), and keeps the direction. */
  fill(place_m, radius_mm) {
    this.centerOn(place_m);
    const away = radius_mm / Math.sin(THREE.MathUtils.degToRad(kFieldOfView / 2)) / Math.min(1, this.camera.aspect);
    this.zoom(1.1 * away / this.camera.position.distanceTo(this.controls.target));
  }

  /** Something moved: draw again, with what can be drawn in time. */
  touch() {
    this.isDirty = true;
    this.isStill = false;
    this.touched = performance.now();
  }

  retheme() {
    this.scene.background = new THREE.Color(styleColor('--stage'));
    this.touch();
  }

  resize() {
    const width = Math.max(1, this.host.clientWidth), height = Math.max(1, this.host.clientHeight);
    const ratio = this.drawer.isSoftware ? 1 : Math.min(2, devicePixelRatio || 1);
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
    this.trail.setResolution(width, height);
    this.glyphs.setResolution(width, height);
    this.cutEdge.lines.material.resolution.set(width, height);
    const before = this.camera.aspect;
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    if (before === 1 && !this.isSized) this.zoom(1 / Math.min(1, this.camera.aspect));
    this.isSized = true;
    this.touch();
  }

  /** mm of one pixel at a place of the page's frame, in the plane of the view. */
  mmPerPixel(place) {
    const direction = this.camera.getWorldDirection(new THREE.Vector3());
    const depth = direction.dot(place.clone().sub(this.camera.position));
    const away = depth > 0 ? depth : this.camera.position.distanceTo(place);
    return 2 * away * Math.tan(THREE.MathUtils.degToRad(kFieldOfView / 2)) / Math.max(1, this.host.clientHeight);
  }

  /** Pixels from the view's left upper corner; nothing where the place is behind the camera. */
  toScreen(place) {
    const seen = place.clone().project(this.camera);
    if (!(Math.abs(seen.z) <= 1)) return undefined;
    return {x: (seen.x + 1) / 2 * this.host.clientWidth, y: (1 - seen.y) / 2 * this.host.clientHeight};
  }

  /** Unit vectors of the view in scene axes: to the right, up, towards the viewer. */
  axes() {
    this.camera.updateMatrixWorld();
    const parts = [new THREE.Vector3(), new THREE.Vector3(), new THREE.Vector3()];
    this.camera.matrixWorld.extractBasis(...parts);
    return parts.map(v => [v.x, v.y, v.z]);
  }

  /** Cuts off what is on one side: the plane's normal (scene axes) and place (scene m); null: whole. */
  setCut(normal, place_m) {
    const wasCut = this.isCut, before = this.cut.clone();
    this.isCut = normal !== null;
    if (this.isCut)
      this.cut.setFromNormalAndCoplanarPoint(new THREE.Vector3(...normal),
                                             new THREE.Vector3(...this.toView(place_m)));
    for (const surface of this.surfaces.all) surface.setPlanes(this.isCut ? [this.cut] : []);
    if (this.isCut !== wasCut || !this.cut.equals(before)) this.touch(); // what looks the same may rest
  }

  /** Draws where something changed; true where it did. */
  draw(now) {
    const isSettled = !this.isDirty && !this.isStill && now - this.touched > kStillAfter_ms;
    if (isSettled) this.isDirty = true; // once more, as fine as may be
    if (!this.isDirty) return false;
    this.trail.setMoving(!isSettled);
    if (this.surfaces.chooseLevels(this.pace.budget(isSettled))) {
      this.onLevels?.();
      this.pace.changed();
    }
    this.isStill = isSettled; // onLevels touches the view
    this.isDirty = false;
    this.cutEdge.update(this.surfaces.all, this.isCut ? this.cut : undefined);
    this.placeCamera();
    this.render();
    if (this.pace.isLearning) this.touch();
    return true;
  }

  /** Draws all that there is, whatever time that takes. */
  drawFinest() {
    this.surfaces.chooseLevels(Infinity);
    this.placeCamera();
    this.render();
  }

  placeCamera() {
    const away = this.camera.position.length();
    const toTarget = this.camera.position.distanceTo(this.controls.target); // near it, what is nearer is looked at, too
    const nearest = Math.min(away, toTarget), farthest = Math.max(away, toTarget);
    this.camera.near = Math.max(Math.min(0.02 * this.radius, 0.1 * toTarget), nearest - 4 * this.radius);
    this.camera.far = farthest + 4 * this.radius;
    this.camera.updateProjectionMatrix();
    this.camera.updateMatrixWorld();
    const scale = this.mmPerPixel(this.glyphs.proxy.position);
    this.glyphs.setScale(scale, kReach * this.host.clientHeight * scale);
  }

  render() {
    const isDue = this.pace.isDue;
    const began = performance.now();
    this.renderer.render(this.scene, this.camera);
    if (isDue) {
      const gl = this.renderer.getContext();
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4)); // waits for the end
      const now = performance.now();
      this.pace.measured(now - began, this.surfaces.facets, now);
    } else ++this.pace.pictures;
  }
}

const kZUpToYUp = new THREE.Quaternion().setFromUnitVectors(new THREE.Vector3(0, 0, 1), new THREE.Vector3(0, 1, 0));
const kYUpToZUp = kZUpToYUp.clone().invert();
