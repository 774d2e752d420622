// SPDX-License-Identifier: Apache-2.0
/** Three orthogonal slices of a volume through the proxy, with window and level. */
import {DamagedData} from './container.js';
import {axisNames} from './words.js';
import {kGlyphColors} from './glyphs.js';

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

/** For each axis of the scene the voxel axis that is nearest to it, and its sign. */
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

// Of each slice: the scene axes to the right and down, and whether the scene's sign is turned. With
// LPS: axial as seen from the feet, coronal from the front, sagittal from the left.
const kSlices = [
  {name: 'axial', right: [0, 1], down: [1, 1], through: 2},
  {name: 'coronal', right: [0, 1], down: [2, -1], through: 1},
  {name: 'sagittal', right: [1, 1], down: [2, -1], through: 0},
];
const kTable = new Uint8ClampedArray(256);

class Slice {
  constructor(volume, layout, names, host) {
    this.volume = volume;
    const {chosen, length} = volume.alignment;
    const side = ([axis, sign]) => ({axis: chosen[axis].axis, sign: sign * chosen[axis].sign,
                                     letters: sign > 0 ? [names.minus[axis], names.plus[axis]]
                                                       : [names.plus[axis], names.minus[axis]]});
    this.right = side(layout.right);
    this.down = side(layout.down);
    this.through = chosen[layout.through].axis;
    this.width = volume.shape[this.right.axis];
    this.height = volume.shape[this.down.axis];
    this.aspect = this.width * length[this.right.axis] / (this.height * length[this.down.axis]);
    const figure = document.createElement('figure');
    figure.innerHTML = '<div class="slice"><canvas role="img"></canvas><b></b><b></b><b></b><b></b></div>' +
                       '<figcaption></figcaption>';
    host.append(figure);
    this.canvas = figure.querySelector('canvas');
    this.canvas.width = this.width;
    this.canvas.height = this.height;
    this.canvas.style.aspectRatio = String(this.aspect);
    this.name = names.isPatient ? layout.name : `across ${names.plus[layout.through].slice(1)}`;
    this.canvas.setAttribute('aria-label', `${this.name} slice through the proxy`);
    this.caption = figure.querySelector('figcaption');
    figure.querySelectorAll('b').forEach((letter, i) => {
      letter.textContent = [...this.right.letters, ...this.down.letters][i];
      letter.className = ['west', 'east', 'north', 'south'][i];
    });
    this.context = this.canvas.getContext('2d');
    this.image = this.context.createImageData(this.width, this.height);
    this.pixels = new Uint32Array(this.image.data.buffer);
  }

  /** Place of a voxel index on the canvas. */
  spot(index) {
    const along = (side, size) => (side.sign > 0 ? index[side.axis] : size - 1 - index[side.axis]) + 0.5;
    return [along(this.right, this.width), along(this.down, this.height)];
  }

  draw(proxy, probe, stamp) {
    const {volume} = this;
    const level = Math.round(proxy[this.through]);
    const isInside = level >= 0 && level < volume.shape[this.through];
    const shown = `${level} ${stamp}`;
    if (shown !== this.shown) {
      this.shown = shown;
      this.level = level;
      if (isInside) this.fill(level);
      else this.pixels.fill(0xff000000);
      this.caption.textContent = isInside ? `${this.name} ${level + 1}/${volume.shape[this.through]}`
                                          : `${this.name}: outside the volume`;
    }
    this.context.putImageData(this.image, 0, 0);
    const thin = Math.max(1, this.width / 200);
    const [x, y] = this.spot(proxy), [px, py] = this.spot(probe);
    this.context.lineWidth = thin;
    this.context.strokeStyle = kGlyphColors.proxy;
    this.context.beginPath();
    this.context.moveTo(x, 0);
    this.context.lineTo(x, this.height);
    this.context.moveTo(0, y);
    this.context.lineTo(this.width, y);
    this.context.stroke();
    this.context.fillStyle = '#6db6ff';
    this.context.beginPath();
    this.context.arc(px, py, 2 * thin, 0, 2 * Math.PI);
    this.context.fill();
  }

  fill(level) {
    const {voxels, strides} = this.volume;
    const start = (side, size) => (side.sign > 0 ? 0 : (size - 1) * strides[side.axis]);
    const stepX = this.right.sign * strides[this.right.axis], stepY = this.down.sign * strides[this.down.axis];
    const from = level * strides[this.through] + start(this.right, this.width) + start(this.down, this.height);
    for (let y = 0, at = 0; y < this.height; ++y)
      for (let x = 0; x < this.width; ++x, ++at) {
        const grey = kTable[voxels[from + y * stepY + x * stepX]];
        this.pixels[at] = 0xff000000 | grey << 16 | grey << 8 | grey;
      }
  }
}

export class Slices {
  /** @param {HTMLElement} host where the three canvases go */
  constructor(scene, blob, host) {
    this.host = host;
    this.names = axisNames(scene.axes);
    this.volumes = (scene.volumes ?? []).map(volume => {
      const [nx, ny, nz] = volume.shape;
      return {...volume, voxels: blob(volume.voxels, nx * ny * nz, 'u8'), strides: [1, nx, nx * ny],
              toIndex: inverse(volume.to_scene), alignment: alignment(volume.to_scene)};
    });
    this.stamp = 0;
    if (this.volumes.length) this.choose(0);
  }

  choose(index) {
    this.volume = this.volumes[index];
    this.host.replaceChildren();
    this.slices = kSlices.map(layout => new Slice(this.volume, layout, this.names, this.host));
    this.window = [...(this.volume.window ?? [this.volume.low, this.volume.high])];
  }

  /** @param {number} width of the window @param {number} level its middle, both in the volume's unit */
  setWindow(width, level) {
    this.window = [level - width / 2, level + width / 2];
    ++this.stamp;
  }

  draw(proxy_m, probe_m) {
    if (!this.volume) return;
    const {low, high, toIndex} = this.volume;
    const [from, to] = this.window;
    const tableOf = `${this.volume.name} ${from} ${to}`;
    if (this.tableOf !== tableOf) {
      this.tableOf = tableOf;
      for (let i = 0; i < 256; ++i)
        kTable[i] = 255 * (low + (high - low) * i / 255 - from) / Math.max(1e-30, to - from);
    }
    const [proxy, probe] = [toIndex(proxy_m), toIndex(probe_m)];
    for (const slice of this.slices) slice.draw(proxy, probe, `${tableOf} ${this.stamp}`);
  }
}
