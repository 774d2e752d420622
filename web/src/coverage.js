// SPDX-License-Identifier: Apache-2.0
/**
 * Where a structure was felt: vertices within a radius of the proxy while the structure was touched,
 * for how long, and how hard. Each vertex stands for a third of the area of its facets.
 */

const kLeastRadius = 1; // mm

/** Area of each vertex, mm^2, and the mean length of an edge, mm. */
function measure(places, indices, vertices) {
  const area = new Float64Array(vertices);
  let length = 0;
  const edge = (a, b) => Math.hypot(places[3 * a] - places[3 * b], places[3 * a + 1] - places[3 * b + 1],
                                    places[3 * a + 2] - places[3 * b + 2]);
  for (let f = 0; f < indices.length; f += 3) {
    const [a, b, c] = [indices[f], indices[f + 1], indices[f + 2]];
    const [u, v, w] = [edge(b, c), edge(c, a), edge(a, b)];
    const s = (u + v + w) / 2;
    const third = Math.sqrt(Math.max(0, s * (s - u) * (s - v) * (s - w))) / 3; // Heron
    area[a] += third;
    area[b] += third;
    area[c] += third;
    length += u + v + w;
  }
  return {area, edge_mm: indices.length ? length / indices.length : 0};
}

export class Coverage {
  /**
   * @param {import('three').BufferGeometry} geometry in mm
   * @param {number} radius_mm of the probe
   */
  constructor(geometry, radius_mm) {
    this.places = geometry.getAttribute('position').array;
    this.vertices = this.places.length / 3;
    const {area, edge_mm} = measure(this.places, geometry.index.array, this.vertices);
    this.area = area;
    // Less than an edge would leave a proxy between vertices without any.
    this.radius_mm = Math.max(kLeastRadius, radius_mm, edge_mm);
    this.total_mm2 = area.reduce((sum, one) => sum + one, 0);
    this.buildCells();
    this.clear();
  }

  clear() {
    this.isTouched = new Uint8Array(this.vertices);
    this.time_s = new Float32Array(this.vertices);
    this.force_n = new Float32Array(this.vertices);
    this.touched_mm2 = 0;
    this.longest_s = 0;
    this.hardest_n = 0;
    this.done = 0; // frames that were taken in
    this.last = undefined;
  }

  key(x, y, z) {
    return ((x * 73856093) ^ (y * 19349663) ^ (z * 83492791)) & this.mask;
  }

  /** Vertices by cells as wide as the radius: counts, then places (a hash of cells, no pointers). */
  buildCells() {
    let size = 1;
    while (size < this.vertices) size *= 2;
    this.mask = size - 1;
    this.begins = new Uint32Array(size + 1);
    const cell = new Uint32Array(this.vertices);
    const at = i => Math.floor(this.places[i] / this.radius_mm);
    for (let v = 0; v < this.vertices; ++v) {
      cell[v] = this.key(at(3 * v), at(3 * v + 1), at(3 * v + 2));
      ++this.begins[cell[v] + 1];
    }
    for (let i = 0; i < size; ++i) this.begins[i + 1] += this.begins[i];
    const next = this.begins.slice();
    this.members = new Uint32Array(this.vertices);
    for (let v = 0; v < this.vertices; ++v) this.members[next[cell[v]]++] = v;
  }

  /** Vertices within the radius of a place, mm. */
  near(x, y, z) {
    const r = this.radius_mm, found = [], seen = new Set();
    const [cx, cy, cz] = [Math.floor(x / r), Math.floor(y / r), Math.floor(z / r)];
    for (let i = cx - 1; i <= cx + 1; ++i)
      for (let j = cy - 1; j <= cy + 1; ++j)
        for (let k = cz - 1; k <= cz + 1; ++k) {
          const cell = this.key(i, j, k);
          if (seen.has(cell)) continue;
          seen.add(cell);
          for (let m = this.begins[cell]; m < this.begins[cell + 1]; ++m) {
            const v = this.members[m];
            const d = Math.hypot(this.places[3 * v] - x, this.places[3 * v + 1] - y,
                                 this.places[3 * v + 2] - z);
            if (d <= r) found.push(v);
          }
        }
    return found;
  }

  /** A frame in which the structure was felt with its proxy here. */
  touch(place, time_s, force_n) {
    const [x, y, z] = place;
    const moved = this.last ? Math.hypot(x - this.last.x, y - this.last.y, z - this.last.z) : Infinity;
    if (!(moved < this.radius_mm / 10)) // the same vertices serve while the proxy hardly moves
      this.last = {x, y, z, vertices: this.near(x, y, z)};
    for (const v of this.last.vertices) {
      if (!this.isTouched[v]) {
        this.isTouched[v] = 1;
        this.touched_mm2 += this.area[v];
      }
      this.time_s[v] += time_s;
      this.force_n[v] = Math.max(this.force_n[v], force_n);
      this.longest_s = Math.max(this.longest_s, this.time_s[v]);
      this.hardest_n = Math.max(this.hardest_n, force_n);
    }
  }

  /** Takes in the frames that came since the last time. */
  update(frames, bit, period_s, toView) {
    const {felt, proxy_m} = frames.columns;
    for (let i = this.done; i < frames.count; ++i) {
      if (!((felt[i] >>> bit) & 1)) continue;
      const place = toView(proxy_m.subarray(3 * i, 3 * i + 3));
      this.touch(place, frames.duration(i, period_s), frames.force(i));
    }
    this.done = frames.count;
  }

  /** Share of the area that was felt, 0 to 1. */
  get share() {
    return this.total_mm2 > 0 ? this.touched_mm2 / this.total_mm2 : 0;
  }
}
