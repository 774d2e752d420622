// SPDX-License-Identifier: Apache-2.0
/** Force, depth, sub-steps and times over time, with one cursor for all and the frame that is shown. */
import uPlot from 'uplot';
import {roundUp} from './words.js';
import {styleColor} from './colors.js';

const kLiveWindow_s = 10;
// Names and units of the quantities, the least that fills a chart, so that rounding does not, and how a frame has them.
// `isSoft`: shown once a soft surface is pressed in.
const kCharts = [
  {id: 'force', name: 'Force', unit: 'N', series: 1, least: 0.01, of: (f, i) => f.force(i)},
  {id: 'depth', name: 'Depth', unit: 'mm', series: 4, least: 0.01, of: (f, i) => 1000 * f.depth(i)},
  {id: 'indentation', name: 'Indentation', unit: 'mm', series: 6, least: 0.01, isSoft: true, of: (f, i) => 1000 * f.columns.indentation_m[i]},
  {id: 'stiffness', name: 'Stiffness', unit: 'N/mm', series: 7, least: 0.01, isSoft: true, of: (f, i) => f.columns.stiffness_n_per_m[i] / 1000},
  {id: 'sub_steps', name: 'Sub-steps', unit: '', series: 3, least: 1, of: (f, i) => f.columns.sub_steps[i]},
  {id: 'spent_us', name: 'Computing', unit: 'µs', series: 2, least: 1, of: (f, i) => f.columns.spent_us[i]},
  {id: 'late_us', name: 'Lateness', unit: 'µs', series: 5, least: 1, of: (f, i) => f.columns.late_us[i]},
];

/** A number on an axis: 20000 is 20k. */
const shortly = value => (Math.abs(value) >= 10000 ? `${value / 1000}k` : String(value));

export class Charts {
  /** @param {HTMLElement} host @param {import('./app.js').App} app whose frames are shown, and whom a click takes to one */
  constructor(host, app) {
    this.app = app;
    this.frames = app.frames;
    this.isLive = app.isLive;
    this.host = host;
    this.cells = kCharts.map(chart => {
      const cell = document.createElement('div');
      cell.className = 'chart';
      cell.innerHTML = `<h3>${chart.name}<output aria-live="off"></output></h3><div class="plot"></div>`;
      cell.hidden = chart.isSoft === true;
      host.append(cell);
      return {...chart, cell, output: cell.querySelector('output'), plot: cell.querySelector('.plot')};
    });
    this.rebuild();
    new ResizeObserver(() => this.resize()).observe(host);
  }

  options(cell) {
    const ink = styleColor('--soft'), line = styleColor('--line');
    const axis = {stroke: ink, font: '12px system-ui, sans-serif', grid: {stroke: line, width: 1},
                  ticks: {stroke: line, width: 1, size: 4}};
    return {
      width: Math.max(80, cell.plot.clientWidth), height: Math.max(80, cell.plot.clientHeight),
      padding: [6, 10, 0, 0],
      cursor: {sync: {key: 'palpate'}, drag: {x: true, y: false}, points: {size: 7}},
      legend: {show: false},
      scales: {x: {time: false}, y: {range: (u, low, high) => [Math.min(0, low ?? 0), roundUp(Math.max(high ?? 1, cell.least))]}},
      axes: [{...axis, size: 24, gap: 2, space: 60, values: (u, ticks) => ticks.map(t => `${t} s`)},
             {...axis, size: 46, gap: 3, space: 26, values: (u, ticks) => ticks.map(shortly)}],
      series: [{}, {stroke: styleColor(`--s${cell.series}`), width: 1.5, points: {show: false}}],
      hooks: {setSize: [() => this.moveMarker()], setScale: [() => this.moveMarker()]},
    };
  }

  /** Makes the charts anew, for other colours. */
  rebuild() {
    this.isZoomed = false;
    for (const cell of this.cells) {
      cell.chart?.destroy();
      cell.chart = new uPlot(this.options(cell), [[], []], cell.plot);
      cell.marker = document.createElement('div');
      cell.marker.className = 'now';
      cell.chart.over.append(cell.marker);
      let down;
      cell.chart.over.addEventListener('pointerdown', event => (down = event.clientX));
      const isDrag = event => Math.abs(event.clientX - down) > 3;
      cell.chart.over.addEventListener('pointerup', event => isDrag(event) && (this.isZoomed = true)); // until a double click
      let before; // where the first of two clicks has gone from
      cell.chart.over.addEventListener('click', event => {
        if (isDrag(event) || event.detail > 1) return;
        before = this.app.moment;
        const left = event.clientX - cell.chart.over.getBoundingClientRect().left;
        this.app.seek(this.frames.at(cell.chart.posToVal(left, 'x')));
      });
      cell.chart.over.addEventListener('dblclick', () => {
        this.isZoomed = false;
        if (before) this.app.goBack(before);
      });
    }
    this.update();
  }

  /** The charts that there is something for; others come with the first frame that has it, and go where all begins anew. */
  shown() {
    const {isSoft} = this.frames;
    const changed = this.cells.filter(one => one.isSoft && one.cell.hidden === isSoft);
    for (const {cell} of changed) cell.hidden = !isSoft;
    if (changed.length) {
      this.host.classList.toggle('many', isSoft);
      this.resize();
    }
    return this.cells.filter(({cell}) => !cell.hidden);
  }

  /** Draws frames that came, at most the last seconds of a live loop. */
  update() {
    const {frames} = this;
    if (!frames.count) this.isZoomed = false; // all begins anew
    const newest = frames.count ? frames.columns.time_s[frames.count - 1] : 0;
    const shown = this.isZoomed && this.cells[0].chart.scales.x.min; // of a zoom that frames leave behind
    const begin = this.isLive ? frames.at(Math.min(newest - kLiveWindow_s, Number.isFinite(shown) ? shown : newest)) : 0;
    const times = frames.columns.time_s.subarray(begin, frames.count);
    for (const cell of this.shown()) {
      const values = new Float64Array(times.length);
      for (let i = 0; i < values.length; ++i) values[i] = cell.of(frames, begin + i);
      cell.chart.setData([times, values], !this.isZoomed);
      if (this.isZoomed) cell.chart.redraw();
      const most = values.reduce((a, b) => (b > a ? b : a), 0);
      cell.plot.setAttribute('role', 'img');
      cell.plot.setAttribute('aria-label', `${cell.name} over time, at most ${most.toPrecision(3)} ${cell.unit}`);
    }
    this.moveMarker();
  }

  /** Shows this frame in all charts. */
  show(index, text) {
    this.index = index;
    for (const cell of this.shown()) {
      cell.output.textContent = text(cell, cell.of(this.frames, index));
      cell.output.dataset.value = String(cell.of(this.frames, index));
    }
    this.moveMarker();
  }

  moveMarker() {
    if (this.index === undefined || !this.frames.count) return;
    const time = this.frames.columns.time_s[Math.min(this.index, this.frames.count - 1)];
    for (const {chart, marker} of this.cells) {
      if (!marker) continue;
      const left = chart.valToPos(time, 'x');
      marker.style.display = left >= 0 && left <= chart.over.clientWidth ? '' : 'none';
      marker.style.transform = `translateX(${left}px)`;
    }
  }

  resize() {
    for (const cell of this.cells)
      cell.chart.setSize({width: Math.max(80, cell.plot.clientWidth), height: Math.max(80, cell.plot.clientHeight)});
  }
}
