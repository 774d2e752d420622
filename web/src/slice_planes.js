// SPDX-License-Identifier: Apache-2.0
/** The three slices as planes among the surfaces, through the proxy. What is nearly black in a slice is left out, so that air hides nothing. */
import * as THREE from 'three';

const kCorners = [[0, 0], [1, 0], [1, 1], [0, 1]];

/** A slice's picture, where it is. No cut applies to it. */
class Plane {
  constructor(slice) {
    this.slice = slice;
    this.texture = new THREE.DataTexture(slice.image.data, slice.width, slice.height);
    this.texture.colorSpace = THREE.SRGBColorSpace;
    const geometry = new THREE.BufferGeometry();
    this.places = new THREE.BufferAttribute(new Float32Array(12), 3);
    geometry.setAttribute('position', this.places);
    geometry.setAttribute('uv', new THREE.BufferAttribute(new Float32Array(kCorners.flat()), 2));
    geometry.setIndex([0, 1, 2, 0, 2, 3]);
    this.mesh = new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({map: this.texture, side: THREE.DoubleSide, alphaTest: 0.999}));
    this.mesh.frustumCulled = false;
    this.mesh.name = slice.name;
  }

  update(toView) {
    const {slice} = this;
    this.mesh.visible = Boolean(slice.isInside);
    if (!this.mesh.visible) return;
    kCorners.forEach(([u, v], i) => {
      const index = slice.indexAt([u * slice.width, v * slice.height], slice.depth);
      this.places.setXYZ(i, ...toView(slice.grid.place(index)));
    });
    this.places.needsUpdate = true;
    if (this.version === slice.version) return;
    this.version = slice.version;
    this.texture.needsUpdate = true;
  }

  dispose() {
    this.texture.dispose();
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
  }
}

export class SlicePlanes {
  constructor(toView) {
    this.toView = toView;
    this.group = new THREE.Group();
    this.group.visible = false;
    this.planes = [];
  }

  get isShown() {
    return this.group.visible;
  }

  setShown(isShown) {
    this.group.visible = isShown;
  }

  /** After the slices were drawn. @param {import('./slices.js').Slice[]} slices */
  update(slices) {
    if (!this.isShown) return;
    if (slices.some((slice, i) => slice !== this.planes[i]?.slice)) {
      for (const plane of this.planes) plane.dispose();
      this.planes = slices.map(slice => new Plane(slice));
      this.group.clear();
      this.group.add(...this.planes.map(plane => plane.mesh));
    }
    for (const plane of this.planes) plane.update(this.toView);
  }
}
