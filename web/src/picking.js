// SPDX-License-Identifier: Apache-2.0
/** Which structure is under the pointer: named while it hovers, selected by a click. */
import * as THREE from 'three';

const kClick_px = 4; // a pointer that moved further was a drag
const kBeside_px = 14; // of the name, from the pointer

export class Picking {
  /**
   * @param {import('./view3d.js').View3d} view
   * @param {HTMLElement} tag for the name
   * @param {(surface: any) => void} onClick with what was clicked, or nothing
   */
  constructor(view, tag, onClick) {
    this.view = view;
    this.tag = tag;
    this.onClick = onClick;
    this.ray = new THREE.Raycaster();
    const {canvas} = view;
    canvas.addEventListener('pointermove', event => (this.at = event.buttons || event.pointerType === 'touch' ? null : this.spot(event)));
    canvas.addEventListener('pointerleave', () => (this.at = null));
    canvas.addEventListener('pointerdown', event => (this.down = event.button === 0 ? this.spot(event) : undefined));
    canvas.addEventListener('pointerup', event => this.up(this.spot(event)));
  }

  spot(event) {
    const box = this.view.canvas.getBoundingClientRect();
    return {x: event.clientX - box.left, y: event.clientY - box.top};
  }

  up(at) {
    const {down} = this;
    this.down = undefined;
    if (down && Math.hypot(at.x - down.x, at.y - down.y) <= kClick_px) this.onClick(this.surfaceAt(at));
  }

  /** The nearest surface that is seen at a place of the view: by its coarsest level, which is quick and near enough for a name. */
  surfaceAt({x, y}) {
    const {view} = this, {clientWidth: width, clientHeight: height} = view.host;
    this.ray.setFromCamera(new THREE.Vector2(2 * x / width - 1, 1 - 2 * y / height), view.camera);
    let nearest;
    for (const surface of view.surfaces.all) {
      if (!surface.mesh.visible || !surface.target) continue;
      const isCut = view.isCut && surface.isCut;
      const hit = this.ray.intersectObject(surface.target).find(one => !isCut || view.cut.distanceToPoint(one.point) >= 0);
      if (hit && !(nearest?.distance <= hit.distance)) nearest = {surface, distance: hit.distance};
    }
    return nearest?.surface;
  }

  /** Once a picture: the name of what the pointer is over. */
  update() {
    if (this.at === this.named) return;
    this.named = this.at;
    const surface = this.at ? this.surfaceAt(this.at) : undefined;
    this.tag.hidden = !surface;
    if (!surface) return;
    this.tag.textContent = surface.structure.name;
    const {host} = this.view;
    const x = Math.min(this.at.x + kBeside_px, host.clientWidth - this.tag.offsetWidth);
    const y = Math.min(this.at.y + kBeside_px, host.clientHeight - this.tag.offsetHeight);
    this.tag.style.transform = `translate(${Math.round(x)}px, ${Math.round(y)}px)`;
  }
}
