// SPDX-License-Identifier: Apache-2.0
// Writes the page's container, from its description alone (docs/view_protocol.md), and a sphere that is felt along a known path.
import {gzipSync} from 'node:zlib';

const kTypes = {Uint8Array: 'u8', Int16Array: 'i16', Uint16Array: 'u16', Uint32Array: 'u32', Float32Array: 'f32', Float64Array: 'f64'};

/** @param {any} json without "blobs" @param {Record<string, any>} arrays typed arrays by name */
export function container(json, arrays) {
  const blobs = {}, parts = [];
  let offset = 0;
  for (const [name, array] of Object.entries(arrays)) {
    blobs[name] = {type: kTypes[array.constructor.name], offset, count: array.length};
    const bytes = Buffer.from(array.buffer, array.byteOffset, array.byteLength);
    const padding = Buffer.alloc((8 - bytes.length % 8) % 8);
    parts.push(bytes, padding);
    offset += bytes.length + padding.length;
  }
  const text = Buffer.from(JSON.stringify({...json, blobs}));
  const head = Buffer.alloc(16);
  head.write('PALPVIEW', 'latin1');
  head.writeUInt32LE(1, 8);
  head.writeUInt32LE(text.length, 12);
  return Buffer.concat([head, text, Buffer.alloc((8 - text.length % 8) % 8), ...parts]);
}

/** The page with a container inside. */
export function withData(page, bytes, encoding = 'gzip+base64') {
  const coded = (encoding === 'gzip+base64' ? gzipSync(bytes) : bytes).toString('base64');
  const element = `<script type="application/octet-stream" id="palpate-data" data-encoding="${encoding}">${coded}</script>`;
  return page.split('<!-- PALPATE-DATA -->').join(element);
}

/** A sphere of radius r (m) about a place, by rings and sectors; positions are quantised in its box. */
export function sphere(center, r, rings) {
  const sectors = 2 * rings, positions = [], indices = [];
  const q = v => Math.round(65535 * (v + 1) / 2);
  for (let i = 0; i <= rings; ++i)
    for (let j = 0; j < sectors; ++j) {
      const theta = Math.PI * i / rings, phi = 2 * Math.PI * j / sectors;
      positions.push(q(Math.sin(theta) * Math.cos(phi)), q(Math.sin(theta) * Math.sin(phi)), q(Math.cos(theta)));
    }
  for (let i = 0; i < rings; ++i)
    for (let j = 0; j < sectors; ++j) {
      const a = i * sectors + j, b = i * sectors + (j + 1) % sectors, c = a + sectors, d = b + sectors;
      if (i > 0) indices.push(a, c, b);
      if (i < rings - 1) indices.push(b, c, d);
    }
  const box_m = [center.map(v => v - r), center.map(v => v + r)];
  return {positions: new Uint16Array(positions), indices: new Uint32Array(indices), box_m, facets: indices.length / 3};
}

export const kRadius = 0.04; // m
export const kCenter = [0.01, -0.02, 0.03]; // m
export const kFrames = 2000;

/** Frame i: one turn around the equator, from 1 s on 2 mm deep, a force of up to 2 N, numbers that are no round ones. */
export function frame(i) {
  const angle = 2 * Math.PI * i / kFrames, isFelt = i >= 1000;
  const depth = isFelt ? 0.002 * Math.sin(Math.PI * (i - 999) / 1001) : -0.003;
  const out = [Math.cos(angle), Math.sin(angle), 0];
  const place = radius => out.map((v, axis) => kCenter[axis] + radius * v);
  return {
    time_s: i / 1000, probe_m: place(kRadius - depth), proxy_m: place(isFelt ? kRadius : kRadius - depth),
    force_n: out.map(v => (isFelt ? v * 1000 * depth : 0)), trial: 0, flags: i === 1500 ? 8 : 0, felt: isFelt ? 1 : 0,
    sub_steps: isFelt ? 3 + i % 5 : 1, spent_us: 4.25 + i % 7, late_us: (i * 37) % 50,
  };
}

const kColumns = {time_s: [Float64Array, 1], probe_m: [Float64Array, 3], proxy_m: [Float64Array, 3], force_n: [Float64Array, 3],
                  trial: [Uint32Array, 1], flags: [Uint32Array, 1], felt: [Uint32Array, 1], sub_steps: [Uint32Array, 1],
                  spent_us: [Float32Array, 1], late_us: [Float32Array, 1]};

/** Entry "frames" and blobs of frames [first, first + count). */
export function framesOf(first, count, lost = 0) {
  const arrays = {}, columns = {};
  for (const [name, [Type, width]] of Object.entries(kColumns)) {
    arrays[name] = new Type(count * width);
    columns[name] = name;
    for (let i = 0; i < count; ++i) arrays[name].set([frame(first + i)[name]].flat(), i * width);
  }
  return {frames: {first, count, lost, columns}, arrays};
}

/** The same frames with a soft surface pressed in by a millimetre in each. */
export function softFramesOf(first, count) {
  const {frames, arrays} = framesOf(first, count);
  const soft = {indentation_m: new Float32Array(count).fill(1e-3), stiffness_n_per_m: new Float32Array(count).fill(200),
                pressed: new Uint32Array(count).fill(1), front_m: arrays.proxy_m.slice()};
  for (const [name, values] of Object.entries(soft)) {
    arrays[name] = values;
    frames.columns[name] = name;
  }
  return {frames, arrays};
}

/** A volume whose values are the distance from the sphere's centre: 64 voxels of 2 mm on a side. */
function volume() {
  const n = 64, spacing = 0.002, voxels = new Uint8Array(n * n * n);
  const start = kCenter.map(v => v - spacing * (n - 1) / 2);
  for (let k = 0, at = 0; k < n; ++k)
    for (let j = 0; j < n; ++j)
      for (let i = 0; i < n; ++i, ++at) {
        const d = Math.hypot(...[i, j, k].map((v, axis) => start[axis] + spacing * v - kCenter[axis]));
        voxels[at] = Math.max(0, Math.min(255, Math.round(255 * (1 - d / 0.064))));
      }
  const to_scene = [spacing, 0, 0, start[0], 0, spacing, 0, start[1], 0, 0, spacing, start[2], 0, 0, 0, 1];
  return {voxels, entry: {name: 'head', shape: [n, n, n], to_scene, voxels: 'voxels', low: -1000, high: 1550,
                          window: [-200, 800], unit: 'HU'}};
}

/** The whole scene as a container. @param {'playback' | 'live'} mode @param {any} changes of its description @param {any} arrays more */
export function sphereScene(mode, changes = {}, arrays = {}) {
  const levels = [12, 60].map(rings => sphere(kCenter, kRadius, rings));
  const inner = sphere(kCenter, 0.02, 12), {voxels, entry} = volume();
  const played = mode === 'playback' ? framesOf(0, kFrames) : {arrays: {}};
  const level = (one, name) => ({facets: one.facets, positions: `${name}_p`, indices: `${name}_i`});
  const plane = (normal, active) => ({at_m: kCenter.map((v, i) => v + kRadius * normal[i]), normal, strength_n: null, structure: 0, active});
  const onPlane = t => [kCenter[0] + 0.004 * t, kCenter[1] - kRadius, kCenter[2]];
  const json = {
    kind: 'scene', title: 'sphere.toml', mode, program: 'palpate 0.1.0', rate_hz: 1000, method: 'adaptive', device: 'orbit',
    force_limit_n: 5, axes: 'LPS', unit: 'm',
    structures: [
      {id: 0, name: 'bone', color: '#e3d4b0', material: 'hard', bit: 0, box_m: levels[0].box_m,
       levels: [level(levels[0], 'coarse'), level(levels[1], 'fine')]},
      {id: 1, name: 'core', color: '#c05a5a', material: '', bit: 1, box_m: inner.box_m, levels: [level(inner, 'inner')]},
    ],
    volumes: [entry],
    effects: [{id: 0, name: 'bone', kind: 'surface', parts: [{name: 'strength', gain: 1, most: 1}]},
              {id: 1, name: 'water', kind: 'viscosity', parts: [{name: 'strength', gain: 0.5, most: 1}]}],
    flags: [{bit: 3, name: 'solver_cap', remedy: 'give it more steps'}],
    probe: {radius_m: 0}, view: {center_m: kCenter, radius_m: 0.05}, frames: played.frames,
    marks: [{name: 'start', at_m: [kCenter[0] + kRadius, kCenter[1], kCenter[2]], time_s: 0, label: 'bone'}],
    details: {1500: [1, 0.5, 0].map((t, i) => ({
      kind: 'goes straight', proxy_m: onPlane(t), candidate_m: onPlane(0), wanted_m: onPlane(0), to_m: onPlane(i === 0 ? 0.5 : 0),
      planes: [plane([0, -1, 0], true), plane([1, 0, 0], false)],
      ...(i === 0 ? {stop: {by: 'certificate', structure: 0, at_m: onPlane(0.25)}} : {})}))},
    ...changes,
  };
  return container(json, {coarse_p: levels[0].positions, coarse_i: levels[0].indices, fine_p: levels[1].positions,
                          fine_i: levels[1].indices, inner_p: inner.positions, inner_i: inner.indices, voxels, ...played.arrays, ...arrays});
}
