// SPDX-License-Identifier: Apache-2.0
/** Where the voxels of a volume are: its indices, and places of the scene (m). */
import {DamagedData} from './container.js';

/** Inverse of the affine of a volume: scene m to voxel index. Rows of a 4 x 4 matrix. */
function inverse(m) {
  const [a, b, c, tx, d, e, f, ty, g, h, i, tz] = m;
  const det = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g);
  if (!Number.isFinite(det) || det === 0) throw new DamagedData('"to_scene" of a volume cannot be inverted.');
  const r = [e * i - f * h, c * h - b * i, b * f - c * e, f * g - d * i, a * i - c * g, c * d - a * f,
             d * h - e * g, b * g - a * h, a * e - b * d].map(v => v / det);
  return place => [0, 1, 2].map(row => r[3 * row] * (place[0] - tx) + r[3 * row + 1] * (place[1] - ty) +
                                       r[3 * row + 2] * (place[2] - tz));
}

/** For each axis of the scene the voxel axis that is nearest to it, its sign, and the lengths of the voxel axes. */
function alignment(m) {
  const length = [0, 1, 2].map(c => Math.hypot(m[c], m[4 + c], m[8 + c]));
  const left = [[0, 1, 2], [0, 1, 2]], chosen = [];
  while (left[0].length) { // the surest pair first
    let best = {size: -1};
    for (const row of left[0])
      for (const column of left[1]) {
        const part = m[4 * row + column] / length[column];
        if (Math.abs(part) > best.size) best = {size: Math.abs(part), row, column, sign: part < 0 ? -1 : 1};
      }
    chosen[best.row] = {axis: best.column, sign: best.sign};
    left[0] = left[0].filter(row => row !== best.row);
    left[1] = left[1].filter(column => column !== best.column);
  }
  return {chosen, length};
}

/** Voxels of a volume of this shape. */
export const voxelCount = shape => shape[0] * shape[1] * shape[2];

export class Grid {
  /** @param {{shape: number[], to_scene: number[]}} volume as the container describes it */
  constructor({shape, to_scene}) {
    this.shape = shape;
    this.strides = [1, shape[0], shape[0] * shape[1]];
    this.toScene = to_scene;
    this.index = inverse(to_scene);
    Object.assign(this, alignment(to_scene));
  }

  /** Scene m of an index. */
  place(index) {
    const m = this.toScene;
    return [0, 4, 8].map(row => m[row] * index[0] + m[row + 1] * index[1] + m[row + 2] * index[2] + m[row + 3]);
  }

  /** The voxel that a place is in; -1 outside. */
  voxelAt(place) {
    let at = 0;
    for (const [axis, value] of this.index(place).entries()) {
      const nearest = Math.round(value);
      if (!(nearest >= 0 && nearest < this.shape[axis])) return -1;
      at += nearest * this.strides[axis];
    }
    return at;
  }
}
