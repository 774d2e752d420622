// SPDX-License-Identifier: Apache-2.0
// The sphere of the other tests with eleven more structures, and a volume of labels over that of numbers.
import {kCenter, kRadius, sphere, sphereScene} from './container.mjs';

export const kEdge = 41, kSpacing = 0.0025; // voxels along each edge, m; their borders are no multiples of the other volume's
export const kNames = ['bone', 'core', ...Array.from({length: 10}, (_, i) => `Nucleus ${i + 1} ${i % 2 ? 'right' : 'left'}`)];
export const kColors = kNames.map((_, i) => `#${(0x2f6b95 + 0x1d3f17 * i & 0xffffff).toString(16).padStart(6, '0')}`);

/** Which label covers a place of the scene, m: 1 the shell, 2 the core, 3 what no structure has; 0 outside. */
export function labelAt(place) {
  const d = Math.hypot(...place.map((v, i) => v - kCenter[i]));
  return d < 0.02 ? 2 : d < 0.03 ? 3 : d < kRadius ? 1 : 0;
}

/** Blobs and description of the volume of labels. */
export function labelVolume() {
  const voxels = new Uint16Array(kEdge ** 3), start = kCenter.map(v => v - kSpacing * (kEdge - 1) / 2);
  for (let k = 0, at = 0; k < kEdge; ++k)
    for (let j = 0; j < kEdge; ++j)
      for (let i = 0; i < kEdge; ++i, ++at) voxels[at] = labelAt([i, j, k].map((v, axis) => start[axis] + kSpacing * v));
  const s = kSpacing, to_scene = [s, 0, 0, start[0], 0, s, 0, start[1], 0, 0, s, start[2], 0, 0, 0, 1];
  return {voxels, entry: {name: 'atlas', shape: [kEdge, kEdge, kEdge], to_scene, voxels: 'atlas', labels: [
    {name: 'Bone', color: kColors[0], structure: 0}, {name: 'Core', color: kColors[1], structure: 1},
    {name: 'Between', color: '#ff0000', structure: -1}]}};
}

/** Twelve structures: the ball of the frames, its core, and ten small ones around; a volume of labels over that of numbers. */
export function labelScene(mode, more = {}) {
  const ring = kNames.slice(2).map((_, i) => {
    const angle = 2 * Math.PI * i / 10;
    return sphere(kCenter.map((v, axis) => v + 0.055 * [Math.cos(angle), Math.sin(angle), 0][axis]), 0.008, 8);
  });
  const all = [sphere(kCenter, kRadius, 24), sphere(kCenter, 0.02, 12), ...ring], meshes = {};
  const structures = all.map((one, id) => {
    meshes[`p${id}`] = one.positions;
    meshes[`i${id}`] = one.indices;
    return {id, name: kNames[id], color: kColors[id], material: 'hard', bit: id, box_m: one.box_m,
            levels: [{facets: one.facets, positions: `p${id}`, indices: `i${id}`}]};
  });
  const {voxels, entry} = labelVolume();
  const changes = {structures, label_volumes: [entry], marks: [], details: undefined, view: {center_m: kCenter, radius_m: 0.07},
                   ...more};
  return sphereScene(mode, changes, {atlas: voxels, ...meshes});
}
