// SPDX-License-Identifier: Apache-2.0
// Two small scenes in which a frame is hard to solve, made by formulas: volumes, a mesh, the probe's path, the scene. docs/contact.md
// shows them; steps_test.mjs and scripts/draw_hard_cases.mjs run them.
import {mkdirSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';

/** A volume of `count` voxels of 1 mm along each edge about the origin, with value(x, y, z) in mm. */
function volume(file, type, count, value, fields = '') {
  const first = -(count - 1) / 2, bytes = Buffer.alloc(count ** 3 * (type === 'float' ? 4 : 1));
  let at = 0;
  for (let k = 0; k < count; ++k)
    for (let j = 0; j < count; ++j)
      for (let i = 0; i < count; ++i)
        at = type === 'float' ? bytes.writeFloatLE(value(first + i, first + j, first + k), at)
                              : bytes.writeUInt8(value(first + i, first + j, first + k), at);
  const head = `NRRD0004\ntype: ${type}\ndimension: 3\nspace: left-posterior-superior\nsizes: ${count} ${count} ${count}\n` +
    `space directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (${first},${first},${first})\n` +
    `${type === 'float' ? 'endian: little\n' : ''}encoding: raw\n${fields}\n`;
  writeFileSync(file, Buffer.concat([Buffer.from(head), bytes]));
}

/** The probe's path: place(t) in mm for t from 0 to 1, one row a millisecond. */
function path(file, frames, place) {
  const rows = Array.from({length: frames}, (_, i) => [i / 1000, ...place(i / (frames - 1)).map(v => v / 1000)].join(','));
  writeFileSync(file, `t_s,x_m,y_m,z_m\n${rows.join('\n')}\n`);
}

/** Two lobes that touch: balls of 10 mm about x = -7 and x = 7 mm, cut at x = 0. A probe crosses the crease between them. */
function crease(folder) {
  const segments = ['left', 'right'].map((side, i) => `Segment${i}_ID:=${side}\nSegment${i}_Name:=${side} lobe\n` +
    `Segment${i}_Layer:=0\nSegment${i}_LabelValue:=${i + 1}\n` +
    `Segment${i}_Color:=${['0.86 0.72 0.74', '0.66 0.79 0.84'][i]}\n`).join('');
  const isIn = (x, y, z) => Math.hypot(Math.abs(x) - 7, y, z) < 10;
  volume(join(folder, 'lobes.seg.nrrd'), 'unsigned char', 41, (x, y, z) => (isIn(x, y, z) ? (x < 0 ? 1 : 2) : 0), segments);
  path(join(folder, 'crease.csv'), 10, t => [-3 + 6 * t, -2 + 4 * t, t === 0 ? 14 : 6]);
  writeFileSync(join(folder, 'crease.toml'), `# A probe that crosses the crease between two labels, 0.8 mm a frame.
[volume.lobes]
file = "lobes.seg.nrrd"
[material.soft]
static = 0.3
dynamic = 0.2
[surface.left_lobe]
volume = "lobes"
label = "left lobe"
material = "soft"
facet_size_mm = 0.3
facet_distance_mm = 0.1
[surface.right_lobe]
volume = "lobes"
label = "right lobe"
material = "soft"
facet_size_mm = 0.3
facet_distance_mm = 0.1
[[effect]]
type = "surface"
surface = ["left_lobe", "right_lobe"]
[[effect]]
type = "friction"
surface = ["left_lobe", "right_lobe"]
[device]
type = "path"
file = "crease.csv"
`);
}

const kLean = 0.3; // rad: the wall leans against the grid
const kAlong = [Math.cos(kLean), 0, -Math.sin(kLean)], kAcross = [Math.sin(kLean), 0, Math.cos(kLean)];
const kEdge = 16; // mm, half of the wall's length
const onWall = (u, v, w) => [0, 1, 2].map(axis => u * kAlong[axis] + (axis === 1 ? v : 0) + w * kAcross[axis]);

/** Half of the wall's thickness in mm: 2 mm, and 0.15 mm within 1 mm of the middle, a dent. */
function halfThickness(u, v) {
  const t = Math.min(1, Math.max(0, (Math.hypot(u, v) - 1) / 2.5));
  return 0.15 + 1.85 * t * t * (3 - 2 * t);
}

/** The same wall as a closed mesh, mm. */
function wallMesh(file) {
  const cells = 64, vertices = [], faces = [], row = 2 * (cells + 1);
  for (let j = 0; j <= cells; ++j)
    for (let i = 0; i <= cells; ++i)
      for (const side of [1, -1]) {
        const [u, v] = [i, j].map(n => kEdge * (2 * n / cells - 1));
        vertices.push(onWall(u, v, side * halfThickness(u, v)));
      }
  const id = (i, j, side) => j * row + 2 * i + (side > 0 ? 0 : 1);
  const quad = (a, b, c, d) => faces.push([a, b, c], [a, c, d]);
  for (let j = 0; j < cells; ++j)
    for (let i = 0; i < cells; ++i) {
      quad(id(i, j, 1), id(i + 1, j, 1), id(i + 1, j + 1, 1), id(i, j + 1, 1));
      quad(id(i, j, -1), id(i, j + 1, -1), id(i + 1, j + 1, -1), id(i + 1, j, -1));
    }
  for (let n = 0; n < cells; ++n) {
    quad(id(n, 0, 1), id(n, 0, -1), id(n + 1, 0, -1), id(n + 1, 0, 1));
    quad(id(n, cells, 1), id(n + 1, cells, 1), id(n + 1, cells, -1), id(n, cells, -1));
    quad(id(0, n, 1), id(0, n + 1, 1), id(0, n + 1, -1), id(0, n, -1));
    quad(id(cells, n, 1), id(cells, n, -1), id(cells, n + 1, -1), id(cells, n + 1, 1));
  }
  writeFileSync(file, `ply\nformat ascii 1.0\nelement vertex ${vertices.length}\nproperty double x\nproperty double y\nproperty double z\n` +
    `element face ${faces.length}\nproperty list uchar int vertex_indices\nend_header\n` +
    `${vertices.map(v => v.join(' ')).join('\n')}\n${faces.map(f => `3 ${f.join(' ')}`).join('\n')}\n`);
}

/** A wall with a dent in which it is thinner than a voxel: sampled it has holes there, its mesh has none. A probe presses into it. */
function leash(folder) {
  const inside = (x, y, z) => {
    const along = axis => x * axis[0] + z * axis[2];
    return Math.min(halfThickness(along(kAlong), y) - Math.abs(along(kAcross)), kEdge - Math.abs(along(kAlong)), kEdge - Math.abs(y));
  };
  volume(join(folder, 'wall.nrrd'), 'float', 41, inside);
  wallMesh(join(folder, 'wall.ply'));
  path(join(folder, 'leash.csv'), 10, t => onWall(-0.5, 0.5, 3 - 6 * t));
  writeFileSync(join(folder, 'leash.toml'), `# A probe that presses into a dent where the wall is thinner than a voxel, 0.67 mm a frame.
[volume.wall]
file = "wall.nrrd"
[surface.wall]
volume = "wall"
iso_value = 0
mesh = "wall.ply"
contact = "guarded"
[[effect]]
type = "surface"
surface = "wall"
[device]
type = "path"
file = "leash.csv"
`);
}

/** Writes both scenes into a folder: crease.toml and leash.toml. */
export function writeHardCases(folder) {
  mkdirSync(folder, {recursive: true});
  crease(folder);
  leash(folder);
}
