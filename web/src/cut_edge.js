// SPDX-License-Identifier: Apache-2.0
/** Where surfaces are cut, the line along which they are: without it, a shell that is open to the viewer is hard to read. */
import {Lines} from './ink.js';

/** Ends of the lines in which a plane meets a mesh, in the mesh's frame. @param {import('three').Plane} plane */
export function edgeOf(geometry, plane) {
  const {array: places} = geometry.getAttribute('position'), {array: corners} = geometry.index, ends = [];
  const {x, y, z} = plane.normal, {constant} = plane;
  const depth = new Float32Array(places.length / 3);
  for (let v = 0; v < depth.length; ++v) depth[v] = x * places[3 * v] + y * places[3 * v + 1] + z * places[3 * v + 2] + constant;
  const cross = (a, b) => {
    const t = depth[a] / (depth[a] - depth[b]);
    for (let axis = 0; axis < 3; ++axis) ends.push(places[3 * a + axis] + t * (places[3 * b + axis] - places[3 * a + axis]));
  };
  for (let i = 0; i < corners.length; i += 3) {
    const above = [0, 1, 2].map(k => depth[corners[i + k]] >= 0);
    if (above[0] === above[1] && above[1] === above[2]) continue;
    for (let k = 0; k < 3; ++k) if (above[k] !== above[(k + 1) % 3]) cross(corners[i + k], corners[i + (k + 1) % 3]);
  }
  return ends;
}

export class CutEdge {
  constructor() {
    this.lines = new Lines('edge', 1.5, 8);
    this.object = this.lines.object;
  }

  /** Follows the cut and the surfaces that it cuts; does nothing where neither has changed. */
  update(surfaces, plane) {
    const cut = plane ? surfaces.filter(surface => surface.isCut && surface.mesh.visible && surface.level) : [];
    const key = plane && [...plane.normal.toArray(), plane.constant,
                          ...cut.map(surface => `${surface.structure.id}/${surface.level.facets}`)].join(' ');
    if (key === this.key) return;
    this.key = key;
    this.lines.set(cut.flatMap(surface => edgeOf(surface.mesh.geometry, plane)));
  }
}
