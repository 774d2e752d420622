// SPDX-License-Identifier: Apache-2.0
/** Three orthogonal slices through the proxy: of a volume with window and level, of labels over it, or of labels alone. */
import {Grid, voxelCount} from './grid.js';
import {LabelMap} from './label_map.js';
import {axisNames, readable} from './words.js';
import {kGlyphColors} from './glyphs.js';

// Of each slice: the scene axes to the right and down, and whether the scene's sign is turned. With
// LPS: axial as seen from the feet, coronal from the front, sagittal from the left.
const kSlices = [
  {name: 'axial', right: [0, 1], down: [1, 1], through: 2},
  {name: 'coronal', right: [0, 1], down: [2, -1], through: 1},
  {name: 'sagittal', right: [1, 1], down: [2, -1], through: 0},
];
const kOpaque = 0xff000000, kLeftOut = 0xfe000000; // alpha: what is left out is seen in a slice, and not as a plane
const kNearlyBlack = 12; // of 255: air, with its noise, in a window for bone
const kProbe = '#6db6ff'; // the probe's colour, lighter: on black

/** One of the three: its picture, and how its pixels lie in the grid. */
export class Slice {
  constructor(grid, layout, names, host) {
    this.grid = grid;
    const side = ([axis, sign]) => ({axis: grid.chosen[axis].axis, sign: sign * grid.chosen[axis].sign,
                                     letters: sign > 0 ? [names.minus[axis], names.plus[axis]]
                                                       : [names.plus[axis], names.minus[axis]]});
    this.right = side(layout.right);
    this.down = side(layout.down);
    this.through = grid.chosen[layout.through].axis;
    this.width = grid.shape[this.right.axis];
    this.height = grid.shape[this.down.axis];
    this.name = names.isPatient ? layout.name : `across ${names.plus[layout.through].slice(1)}`;
    this.build(host);
    this.image = this.context.createImageData(this.width, this.height);
    this.pixels = new Uint32Array(this.image.data.buffer);
    this.version = 0; // of the pixels
  }

  build(host) {
    const figure = document.createElement('figure');
    figure.innerHTML = '<div class="slice"><canvas role="img"></canvas><b></b><b></b><b></b><b></b></div>' +
                       '<figcaption></figcaption>';
    host.append(figure);
    this.canvas = figure.querySelector('canvas');
    this.canvas.width = this.width;
    this.canvas.height = this.height;
    const {length} = this.grid;
    this.canvas.style.aspectRatio = String(this.width * length[this.right.axis] / (this.height * length[this.down.axis]));
    this.canvas.setAttribute('aria-label', `${this.name} slice through the proxy`);
    this.context = this.canvas.getContext('2d');
    this.caption = figure.querySelector('figcaption');
    figure.querySelectorAll('b').forEach((letter, i) => {
      letter.textContent = [...this.right.letters, ...this.down.letters][i];
      letter.className = ['west', 'east', 'north', 'south'][i];
    });
  }

  /** Place of a voxel index on the canvas. */
  spot(index) {
    const along = (side, size) => (side.sign > 0 ? index[side.axis] : size - 1 - index[side.axis]) + 0.5;
    return [along(this.right, this.width), along(this.down, this.height)];
  }

  /** Index of a place on the canvas, in the layer through `depth`. */
  indexAt([x, y], depth) {
    const index = [0, 0, 0];
    index[this.through] = depth;
    index[this.right.axis] = this.right.sign > 0 ? x - 0.5 : this.width - 0.5 - x;
    index[this.down.axis] = this.down.sign > 0 ? y - 0.5 : this.height - 0.5 - y;
    return index;
  }

  /**
   * @param {number[]} proxy index @param {number[]} probe index
   * @param {{volume: any, labels: any, table: Uint8ClampedArray, stamp: number}} paint
   */
  draw(proxy, probe, paint) {
    this.depth = proxy[this.through];
    const level = Math.round(this.depth), most = this.grid.shape[this.through];
    this.isInside = level >= 0 && level < most;
    const shown = `${level} ${paint.stamp}`;
    if (shown !== this.shown) {
      this.shown = shown;
      this.level = level;
      this.pixels.fill(0);
      if (this.isInside && paint.volume) this.fill(level, paint);
      if (this.isInside && paint.labels) this.cover(level, paint.labels);
      this.version += 1;
      this.caption.textContent = this.isInside ? `${this.name} ${level + 1}/${most}` : `${this.name}: outside the volume`;
    }
    this.context.putImageData(this.image, 0, 0);
    this.drawCross(this.spot(proxy), this.spot(probe));
  }

  drawCross([x, y], [px, py]) {
    const {context} = this, thin = Math.max(1, this.width / 200);
    context.lineWidth = thin;
    context.strokeStyle = kGlyphColors.proxy;
    context.beginPath();
    context.moveTo(x, 0);
    context.lineTo(x, this.height);
    context.moveTo(0, y);
    context.lineTo(this.width, y);
    context.stroke();
    context.fillStyle = kProbe;
    context.beginPath();
    context.arc(px, py, 2 * thin, 0, 2 * Math.PI);
    context.fill();
  }

  /** Greys of the volume whose grid this is. What is nearly black is marked: nothing of it is drawn among the surfaces. */
  fill(level, {volume, table}) {
    const {strides} = this.grid, {voxels} = volume;
    const start = (side, size) => (side.sign > 0 ? 0 : (size - 1) * strides[side.axis]);
    const stepX = this.right.sign * strides[this.right.axis], stepY = this.down.sign * strides[this.down.axis];
    const from = level * strides[this.through] + start(this.right, this.width) + start(this.down, this.height);
    for (let y = 0, at = 0; y < this.height; ++y)
      for (let x = 0; x < this.width; ++x, ++at) {
        const grey = table[voxels[from + y * stepY + x * stepX]];
        this.pixels[at] = grey && ((grey > kNearlyBlack ? kOpaque : kLeftOut) | grey << 16 | grey << 8 | grey);
      }
  }

  /** Labels over what is there, each pixel by the voxel of the label's own grid that its middle lies in. */
  cover(level, map) {
    const index = spot => map.grid.index(this.grid.place(this.indexAt(spot, level)));
    const first = index([0.5, 0.5]), [dx, dy] = [[1.5, 0.5], [0.5, 1.5]].map(spot => index(spot).map((v, i) => v - first[i]));
    const {shape: [nx, ny, nz]} = map.grid, {voxels, colors, opacity} = map;
    for (let y = 0, at = 0; y < this.height; ++y)
      for (let x = 0; x < this.width; ++x, ++at) {
        const i = Math.round(first[0] + x * dx[0] + y * dy[0]);
        const j = Math.round(first[1] + x * dx[1] + y * dy[1]);
        const k = Math.round(first[2] + x * dx[2] + y * dy[2]);
        if (i < 0 || j < 0 || k < 0 || i >= nx || j >= ny || k >= nz) continue;
        const label = voxels[i + nx * (j + ny * k)], share = opacity[label];
        if (share === 0) continue;
        const under = this.pixels[at];
        const mix = (channel, color) => ((1 - share) * (under >>> channel & 255) + share * color + 0.5) | 0;
        this.pixels[at] = (kOpaque | mix(16, colors[3 * label + 2]) << 16 | mix(8, colors[3 * label + 1]) << 8 |
                           mix(0, colors[3 * label])) >>> 0;
      }
  }
}

export class Slices {
  /** @param {HTMLElement} host where the three canvases go */
  constructor(scene, blob, host) {
    this.host = host;
    this.names = axisNames(scene.axes);
    this.volumes = (scene.volumes ?? []).map(volume => {
      const voxels = blob(volume.voxels, voxelCount(volume.shape), 'u8');
      return {...volume, voxels, grid: new Grid(volume)};
    });
    this.labelMaps = (scene.label_volumes ?? []).map(entry => new LabelMap(entry, blob));
    this.hidden = new Set();
    this.opacity = 0.5;
    this.table = new Uint8ClampedArray(256);
    this.stamp = 0;
    this.slices = [];
    this.window = [0, 1];
    this.labels = this.labelMaps[0];
    this.choose(0);
  }

  get isEmpty() {
    return this.slices.length === 0;
  }

  /** Shows a volume, and the labels that are chosen over it; without a volume the labels alone. */
  choose(index) {
    this.volume = this.volumes[index];
    const grid = this.volume?.grid ?? this.labels?.grid;
    this.host.replaceChildren();
    this.slices = grid ? kSlices.map(layout => new Slice(grid, layout, this.names, this.host)) : [];
    if (this.volume) this.setWindow(...this.firstWindow());
    this.repaint();
  }

  firstWindow() {
    const [from, to] = this.volume.window ?? [this.volume.low, this.volume.high];
    return [to - from, (from + to) / 2];
  }

  /** @param {number} index of the label volume; -1: none */
  chooseLabels(index) {
    this.labels = this.labelMaps[index];
    if (this.volume) this.repaint();
    else this.choose(-1);
  }

  /** @param {number} width of the window @param {number} level its middle, both in the volume's unit */
  setWindow(width, level) {
    this.window = [level - width / 2, level + width / 2];
    const {low, high} = this.volume, [from, to] = this.window;
    for (let i = 0; i < 256; ++i) this.table[i] = 255 * (low + (high - low) * i / 255 - from) / Math.max(1e-30, to - from);
    this.stamp += 1;
  }

  /** How strongly labels cover the volume, 0 to 1; alone they are opaque. */
  setOpacity(opacity) {
    this.opacity = opacity;
    this.repaint();
  }

  /** A structure that is hidden in the view is hidden here. */
  setShown(structure, isShown) {
    if (isShown) this.hidden.delete(structure);
    else this.hidden.add(structure);
    this.repaint();
  }

  repaint() {
    this.labels?.setOpacity(this.volume ? this.opacity : 1, this.hidden);
    this.stamp += 1;
  }

  draw(proxy_m, probe_m) {
    if (this.isEmpty) return;
    const {grid} = this.slices[0], [proxy, probe] = [grid.index(proxy_m), grid.index(probe_m)];
    for (const slice of this.slices) slice.draw(proxy, probe, this);
  }

  /** What is at a place: the label's name, and the volume's value, as the slices have it. */
  wordsAt(place_m) {
    const at = this.volume ? this.volume.grid.voxelAt(place_m) : -1;
    const {low, high, unit} = this.volume ?? {};
    const value = at < 0 ? undefined : `${readable(low + (high - low) * this.volume.voxels[at] / 255, Infinity)} ${unit ?? ''}`.trim();
    const label = this.labels && (this.labels.nameAt(place_m) ?? 'no label');
    return [label, value].filter(Boolean).join(', ') || 'outside the volume';
  }
}
