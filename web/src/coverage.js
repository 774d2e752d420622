// SPDX-License-Identifier: Apache-2.0
/**
 * Where a structure was felt: points of it within a radius of the proxy while it was touched, for how
 * long, and how hard.
 */

const kLeastRadius = 2; // mm: what counts as felt around the proxy, at least
const kPerRadius = 3; // samples of a facet's area along a radius
const kMostSamples = 32; // along a facet's edge

/** Lengths of the edges of facet f. */
function edges(places, indices, f) {
  return [0, 1, 2].map(i => {
    const a = 3 * indices[f + i], b = 3 * indices[f + (i + 1) % 3];
    const [x, y, z] = [places[a] - places[b], places[a + 1] - places[b + 1], places[a + 2] - places[b + 2]];
    return Math.sqrt(x * x + y * y + z * z);
  });
}

/** Heron's formula. */
function area([a, b, c]) {
  const s = (a + b + c) / 2;
  return Math.sqrt(Math.max(0, s * (s - a) * (s - b) * (s - c)));
}

function meanEdge(places, indices) {
  let sum = 0;
  for (let f = 0; f < indices.length; f += 3) sum += edges(places, indices, f).reduce((a, b) => a + b);
  return indices.length ? sum / indices.length : 0;
}

/** Into how many parts each edge of facet f is divided. */
function parts(lengths, radius) {
  return Math.min(kMostSamples, Math.max(1, Math.ceil(kPerRadius * Math.max(...lengths) / radius)));
}

/** Points all over the facets, denser than the radius, each with the area that it stands for. */
function samplesOf(places, indices, radius) {
  let count = 0;
  for (let f = 0; f < indices.length; f += 3) count += parts(edges(places, indices, f), radius) ** 2;
  const points = new Float32Array(3 * count), areas = new Float32Array(count);
  let at = 0;
  for (let f = 0; f < indices.length; f += 3) {
    const lengths = edges(places, indices, f), n = parts(lengths, radius), each = area(lengths) / (n * n);
    const [a, b, c] = [3 * indices[f], 3 * indices[f + 1], 3 * indices[f + 2]];
    // The centres of n * n equal parts: upright ones, and those upside down between them.
    for (let i = 0; i < n; ++i)
      for (let j = 0; j < 2 * (n - i) - 1; ++j, ++at) {
        const shift = j % 2 ? 2 / 3 : 1 / 3, u = (i + shift) / n, v = ((j >> 1) + shift) / n;
        for (let axis = 0; axis < 3; ++axis)
          points[3 * at + axis] = (1 - u - v) * places[a + axis] + u * places[b + axis] + v * places[c + axis];
        areas[at] = each;
      }
  }
  return {points, areas};
}

/** Coverage of a surface's area: of points all over it. */
export function areaCoverage(geometry, radius_mm) {
  const radius = Math.max(kLeastRadius, radius_mm);
  const {points, areas} = samplesOf(geometry.getAttribute('position').array, geometry.index.array, radius);
  return new Coverage(points, areas, radius);
}

/** Coverage of a surface's vertices, to be painted: with less than an edge a proxy between them had none. */
export function vertexCoverage(geometry, radius_mm) {
  const places = geometry.getAttribute('position').array;
  const edge = meanEdge(places, geometry.index.array);
  const coverage = new Coverage(places, undefined, Math.max(kLeastRadius, radius_mm, edge));
  coverage.edge_mm = edge;
  return coverage;
}

export class Coverage {
  /**
   * @param {Float32Array} places of the points, mm
   * @param {Float32Array | undefined} area of each, mm^2
   * @param {number} radius_mm what counts as felt around the proxy
   */
  constructor(places, area, radius_mm) {
    this.places = places;
    this.count = places.length / 3;
    this.area = area;
    this.radius_mm = radius_mm;
    this.total_mm2 = area?.reduce((sum, one) => sum + one, 0) ?? 0;
    this.buildCells();
    this.clear();
  }

  clear() {
    this.isTouched = new Uint8Array(this.count);
    this.time_s = new Float32Array(this.count);
    this.force_n = new Float32Array(this.count);
    this.touched_mm2 = 0;
    this.longest_s = 0;
    this.hardest_n = 0;
    this.done = 0; // frames that were taken in
    this.last = undefined;
  }

  key(x, y, z) {
    return ((x * 73856093) ^ (y * 19349663) ^ (z * 83492791)) & this.mask;
  }

  /** Points by cells as wide as the radius: counts, then places (a hash of cells, no pointers). */
  buildCells() {
    let size = 1;
    while (size < this.count) size *= 2;
    this.mask = size - 1;
    this.begins = new Uint32Array(size + 1);
    this.visits = new Uint32Array(size); // number of the last search that looked into a cell
    this.searches = 0;
    const cell = new Uint32Array(this.count);
    const at = i => Math.floor(this.places[i] / this.radius_mm);
    for (let v = 0; v < this.count; ++v) {
      cell[v] = this.key(at(3 * v), at(3 * v + 1), at(3 * v + 2));
      ++this.begins[cell[v] + 1];
    }
    for (let i = 0; i < size; ++i) this.begins[i + 1] += this.begins[i];
    const next = this.begins.slice();
    this.members = new Uint32Array(this.count);
    for (let v = 0; v < this.count; ++v) this.members[next[cell[v]]++] = v;
  }

  /** Points within the radius of a place, mm. */
  near(x, y, z) {
    const r = this.radius_mm, found = [], {places} = this;
    const [cx, cy, cz] = [Math.floor(x / r), Math.floor(y / r), Math.floor(z / r)];
    ++this.searches;
    for (let i = cx - 1; i <= cx + 1; ++i)
      for (let j = cy - 1; j <= cy + 1; ++j)
        for (let k = cz - 1; k <= cz + 1; ++k) {
          const cell = this.key(i, j, k);
          if (this.visits[cell] === this.searches) continue; // another cell with the same hash
          this.visits[cell] = this.searches;
          for (let m = this.begins[cell]; m < this.begins[cell + 1]; ++m) {
            const v = this.members[m];
            const [dx, dy, dz] = [places[3 * v] - x, places[3 * v + 1] - y, places[3 * v + 2] - z];
            if (dx * dx + dy * dy + dz * dz <= r * r) found.push(v);
          }
        }
    return found;
  }

  /** A frame in which the structure was felt with its proxy here. */
  touch(place, time_s, force_n) {
    const [x, y, z] = place;
    const moved = this.last ? Math.hypot(x - this.last.x, y - this.last.y, z - this.last.z) : Infinity;
    if (!(moved < this.radius_mm / 4)) // discs so near cover, to 1 % of r, what all between them do
      this.last = {x, y, z, points: this.near(x, y, z)};
    for (const v of this.last.points) {
      if (!this.isTouched[v]) {
        this.isTouched[v] = 1;
        this.touched_mm2 += this.area?.[v] ?? 0;
      }
      this.time_s[v] += time_s;
      this.force_n[v] = Math.max(this.force_n[v], force_n);
      this.longest_s = Math.max(this.longest_s, this.time_s[v]);
      this.hardest_n = Math.max(this.hardest_n, force_n);
    }
  }

  /** Takes in the frames that came since the last time. */
  update(frames, bit, period_s, toView) {
    const {felt} = frames.columns;
    for (let i = this.done; i < frames.count; ++i) {
      if (!((felt[i] >>> bit) & 1)) continue;
      const place = toView(frames.placeOn(bit, i));
      this.touch(place, frames.duration(i, period_s), frames.force(i));
    }
    this.done = frames.count;
  }

  /** What another coverage of the same surface has taken in, each of its points for those around it. */
  takeFrom(other) {
    const within = Math.max(other.edge_mm, this.edge_mm);
    for (let o = 0; o < other.count; ++o) {
      if (!other.isTouched[o]) continue;
      const [x, y, z] = other.places.subarray(3 * o, 3 * o + 3);
      for (const v of this.near(x, y, z)) {
        const way = Math.hypot(this.places[3 * v] - x, this.places[3 * v + 1] - y, this.places[3 * v + 2] - z);
        if (way > within) continue;
        this.isTouched[v] = 1;
        this.time_s[v] = Math.max(this.time_s[v], other.time_s[o]);
        this.force_n[v] = Math.max(this.force_n[v], other.force_n[o]);
      }
    }
    this.longest_s = Math.max(this.longest_s, other.longest_s);
    this.hardest_n = Math.max(this.hardest_n, other.hardest_n);
    this.done = other.done;
  }

  /** Share of the area that was felt, 0 to 1. */
  get share() {
    return this.total_mm2 > 0 ? this.touched_mm2 / this.total_mm2 : 0;
  }
}
