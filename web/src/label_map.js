// SPDX-License-Identifier: Apache-2.0
/** A label volume of the slices: which label covers a voxel, and how it is painted. */
import {DamagedData} from './container.js';
import {Grid, voxelCount} from './grid.js';
import {hexColor} from './colors.js';

const kUnfelt = 0.5; // of the opacity: labels that are no structure of the scene

export class LabelMap {
  /**
   * @param {any} entry of "label_volumes"
   * @param {(name: string, count?: number, type?: string) => any} blob
   */
  constructor(entry, blob) {
    this.name = entry.name;
    this.labels = entry.labels ?? [];
    this.voxels = blob(entry.voxels, voxelCount(entry.shape), 'u16');
    this.grid = new Grid(entry);
    const most = this.voxels.reduce((a, b) => (b > a ? b : a), 0);
    if (most > this.labels.length)
      throw new DamagedData(`Label volume "${this.name}" has label ${most} of ${this.labels.length}.`);
    this.colors = new Uint8Array(3 * (this.labels.length + 1));
    this.labels.forEach((label, i) => this.colors.set(hexColor(label.color).map(c => Math.round(255 * c)), 3 * (i + 1)));
    this.opacity = new Float32Array(this.labels.length + 1);
  }

  /** How strongly each label is painted: those of hidden structures not at all.
   *  @param {number} opacity 0 to 1 @param {Set<number>} hidden ids of structures */
  setOpacity(opacity, hidden) {
    this.labels.forEach(({structure}, i) => {
      this.opacity[i + 1] = hidden.has(structure) ? 0 : structure >= 0 ? opacity : kUnfelt * opacity;
    });
  }

  /** The label's name at a place of the scene, or nothing. */
  nameAt(place_m) {
    const at = this.grid.voxelAt(place_m);
    return at < 0 ? undefined : this.labels[this.voxels[at] - 1]?.name;
  }
}
