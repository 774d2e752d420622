// SPDX-License-Identifier: Apache-2.0
/** Data that nothing is felt of yet: an iso-value or labels are chosen, seen, and saved as a scene. */
import {readable} from './words.js';

const kPlaceSteps = 200; // of a slider through the slices
const kRest_ms = 600; // of the iso-value, before a fine surface is asked for

const at = id => document.getElementById(id);

function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

export class Explore {
  /** @param {import('./app.js').App} app whose scene has a choice */
  constructor(app) {
    this.app = app;
    this.choice = app.scene.choice;
    this.isConnected = true; // the scene has just come
    document.body.dataset.data = this.choice.data;
    at('choice').hidden = false;
    at('iso-choice').hidden = this.choice.data !== 'volume';
    at('label-choice').hidden = this.choice.data !== 'labels';
    at('save').onclick = () => this.save();
    if (this.choice.data === 'volume') this.buildIso();
    if (this.choice.data === 'labels') this.buildLabels();
    if (this.choice.data === 'mesh') this.say('A mesh is felt as it is.');
    this.buildPlaces();
  }

  say(words, isError = false) {
    at('choice-words').textContent = words;
    at('choice-words').classList.toggle('error', isError);
  }

  /** What the server answers in words: an error ends what was asked. */
  hear(message) {
    if (!message.say) return;
    this.say(message.say, message.kind === 'error');
    if (message.kind !== 'error') return;
    const failed = this.asked;
    this.asked = undefined;
    if (failed?.do === 'iso' && failed.value !== this.iso) this.askIso();
  }

  setConnected(isConnected) {
    this.asked = undefined;
    this.isConnected = isConnected;
    this.askNext();
  }

  askNext() {
    if (this.choice.data === 'volume') this.askIso();
    if (this.choice.data === 'labels') this.askLabels();
  }

  ask(command) {
    this.asked = this.app.send(command) ? command : undefined;
    this.began = performance.now();
  }

  /** Surfaces that were asked for. */
  take(json, blob) {
    const {surfaces} = this.app.view;
    for (const structure of json.chosen) {
      surfaces.byId(structure.id)?.replace(structure, blob);
      this.here?.add(structure.id);
    }
    this.asked = undefined;
    this.took_ms = performance.now() - this.began;
    this.app.view.touch();
    if (json.iso) this.takeIso(json.iso);
    else this.sayCounts();
    this.askNext();
  }

  save() {
    if (this.choice.data === 'volume') return this.hasNumber() && this.app.send({do: 'save', iso: this.iso});
    return this.app.send(this.choice.data === 'labels' ? {do: 'save', structures: [...this.felt]} : {do: 'save'});
  }

  // An iso-value.

  buildIso() {
    const [low, high] = this.choice.bounds, [least, most] = this.choice.range;
    Object.assign(at('iso'), {min: low, max: high, step: 'any'});
    Object.assign(at('iso-number'), {min: least, max: most, step: 'any'});
    at('iso').oninput = () => this.setIso(at('iso').valueAsNumber);
    at('iso-number').onchange = () => this.hasNumber() && this.setIso(at('iso-number').valueAsNumber);
    this.drawHistogram();
    this.setIso(this.choice.iso);
  }

  /** Whether the field has a number; without one nothing is chosen. */
  hasNumber() {
    const has = Number.isFinite(at('iso-number').valueAsNumber);
    if (!has) this.say('The iso-value is no number; give one.', true);
    return has;
  }

  /** Counts by their logarithm: of a head, air is ten times all else. */
  drawHistogram() {
    const {histogram} = this.choice, most = Math.log1p(Math.max(...histogram));
    const width = histogram.length;
    const top = histogram.map((count, i) => `L${i} ${40 - 40 * Math.log1p(count) / most}L${i + 1} ${40 - 40 * Math.log1p(count) / most}`);
    at('histogram').innerHTML = `<svg viewBox="0 0 ${width} 40" preserveAspectRatio="none" aria-hidden="true">` +
      `<path d="M0 40${top.join('')}L${width} 40Z"></path><line y1="0" y2="40"></line></svg>`;
  }

  setIso(value) {
    this.iso = value;
    const [low, high] = this.choice.bounds;
    // Five digits of the range, also where that is far from 0.
    const digits = Math.min(15, Math.max(5, 5 + Math.ceil(Math.log10(Math.abs(value) / (high - low)))));
    if (document.activeElement !== at('iso')) at('iso').value = String(value);
    if (document.activeElement !== at('iso-number')) at('iso-number').value = String(Number(value.toPrecision(digits)));
    const line = at('histogram').querySelector('line');
    const x = String(this.choice.histogram.length * Math.min(1, Math.max(0, (value - low) / (high - low))));
    line.setAttribute('x1', x);
    line.setAttribute('x2', x);
    this.askIso();
  }

  /** Soon first; as fine as may be once the slider rests. A coarse one that is on its way is waited for. */
  askIso() {
    if (!this.isConnected || (this.asked && !this.asked.fine)) return;
    const shown = this.shownIso;
    if (shown?.value !== this.iso) return this.ask({do: 'iso', value: this.iso});
    this.say(this.words); // in the place of what was said of another value
    if (!shown.fine && !this.asked) this.askFine();
  }

  /** A fine surface cannot be cancelled at once: it waits until the value rests. */
  askFine() {
    clearTimeout(this.rest);
    this.rest = setTimeout(() => {
      const isWanted = this.shownIso.value === this.iso && !this.shownIso.fine && !this.asked;
      if (this.isConnected && isWanted) this.ask({do: 'iso', value: this.iso, fine: true});
    }, kRest_ms);
  }

  takeIso(iso) {
    this.shownIso = iso;
    if (!iso.fine) this.soon_ms = this.took_ms;
    const surface = this.app.view.surfaces.all[0];
    const facets = surface.levels.at(-1)?.facets ?? 0;
    const otsu = iso.value === this.choice.iso ? ' (Otsu\'s threshold)' : '';
    this.words = `Surface at ${readable(iso.value, Infinity)}${otsu}: its largest part, ${Math.round(facets / 1000)}k facets, ` +
                 `${iso.fine ? 'fine' : 'a first look'} after ${readable(this.took_ms / 1000)} s.`;
    this.say(this.words);
  }

  // Labels.

  buildLabels() {
    this.shown = new Set(this.choice.chosen);
    this.felt = new Set(this.choice.chosen);
    this.here = new Set();
    this.rows = this.app.view.surfaces.all.map(surface => this.labelRow(surface));
    at('label-list').replaceChildren(...this.rows.map(row => row.line));
    at('label-filter').oninput = () => this.filter();
    at('show-listed').onclick = () => this.showAll(row => !row.line.hidden);
    at('show-none').onclick = () => this.showAll(() => false);
    this.filter();
    this.askLabels();
  }

  labelRow(surface) {
    const {id, name, color} = surface.structure;
    const show = make('input', {type: 'checkbox', 'aria-label': `show ${name}`});
    const feel = make('input', {type: 'checkbox', 'aria-label': `feel ${name}`});
    const swatch = make('span', {class: 'swatch'});
    swatch.style.background = color;
    show.onchange = () => this.set(id, {isShown: show.checked});
    feel.onchange = () => this.set(id, {isFelt: feel.checked});
    const line = make('div', {class: 'label'}, make('label', {class: 'check'}, show, 'show'), swatch, make('span', {class: 'name'}, name),
                      make('label', {class: 'check'}, feel, 'feel'));
    show.checked = this.shown.has(id);
    feel.checked = this.felt.has(id);
    this.setShown(surface, show.checked);
    return {id, name, line, show, feel, surface};
  }

  setShown(surface, isShown) {
    surface.setShown(isShown);
    this.app.slices.setShown(surface.structure.id, isShown);
    this.app.shown = undefined;
  }

  /** What is to be felt is shown, too. */
  set(id, {isShown, isFelt}) {
    const put = (set, isIn) => (isIn ? set.add(id) : set.delete(id));
    if (isFelt !== undefined) put(this.felt, isFelt);
    if (isShown !== undefined) put(this.shown, isShown);
    if (isFelt) this.shown.add(id);
    const row = this.rows[id];
    row.show.checked = this.shown.has(id);
    this.setShown(row.surface, row.show.checked);
    at('save').disabled = this.felt.size === 0;
    this.app.view.touch();
    this.sayCounts();
    this.askLabels();
  }

  sayCounts() {
    const ready = [...this.shown].filter(id => this.here.has(id)).length, all = this.shown.size;
    const shown = ready < all ? `${ready} of ${all} labels are ready` : `${all} labels are shown`;
    this.say(this.felt.size ? `${shown}, ${this.felt.size} will be felt.` : 'Choose one label to feel, at least.');
  }

  filter() {
    const text = at('label-filter').value.trim().toLowerCase();
    for (const row of this.rows) row.line.hidden = !row.name.toLowerCase().includes(text);
    const count = this.rows.filter(row => !row.line.hidden).length;
    at('label-count').textContent = `${count} of ${this.rows.length}`;
  }

  showAll(isWanted) {
    for (const row of this.rows)
      if (isWanted(row) !== this.shown.has(row.id) && (isWanted(row) || !row.line.hidden)) this.set(row.id, {isShown: isWanted(row)});
  }

  askLabels() {
    const next = [...this.shown].find(id => !this.here.has(id)); // one by one, so that each is seen soon
    if (this.isConnected && !this.asked && next !== undefined) this.ask({do: 'labels', structures: [next]});
  }

  // Where the slices are.

  buildPlaces() {
    const {app} = this, {view} = app, {names} = app.panels;
    app.place = [...view.center];
    const radius = view.radius / 1000;
    at('places').replaceChildren(...[0, 1, 2].map(axis => {
      const words = `${names.minus[axis]} to ${names.plus[axis]}`;
      const slider = make('input', {type: 'range', min: -1, max: 1, step: 2 / kPlaceSteps, 'aria-label': `slices from ${words}`});
      const output = make('output', {});
      const show = () => (output.textContent = `${(Math.round(10000 * app.place[axis]) / 10 + 0).toFixed(1)} mm`);
      slider.value = '0';
      slider.oninput = () => {
        app.place[axis] = view.center[axis] + radius * slider.valueAsNumber;
        app.shown = undefined;
        show();
      };
      show();
      return make('div', {class: 'row'}, make('label', {}, words), slider, output);
    }));
    at('places').hidden = app.slices.isEmpty;
  }
}
