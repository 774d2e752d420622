// SPDX-License-Identifier: Apache-2.0
/** The list of structures: shown or hidden, transparent, cut, found by name, selected. */
import {at, make} from './make.js';

const kFiltered = 8; // a list that is longer can be searched

export class StructureList {
  /** @param {import('./app.js').App} app */
  constructor(app) {
    this.app = app;
    this.rows = app.view.surfaces.all.map(surface => this.row(surface));
    at('structures').replaceChildren(...this.rows.map(row => row.line));
    at('all-bar').hidden = this.rows.length < 3;
    at('structures').classList.toggle('long', this.rows.length > kFiltered);
    at('filter-row').hidden = this.rows.length <= kFiltered;
    at('show-all').onclick = () => this.showAll(true);
    at('hide-all').onclick = () => this.showAll(false);
    at('filter').oninput = () => this.filter(at('filter').value);
    this.filter('');
  }

  row(surface) {
    const {app} = this, {id, name, color, material} = surface.structure;
    const shown = make('input', {type: 'checkbox', id: `show-${id}`, 'aria-label': `show ${name}`});
    const swatch = make('span', {class: 'swatch'});
    const opacity = make('input', {type: 'range', min: 0, max: 1, step: 0.05, 'aria-label': `opacity of ${name}`});
    const cut = make('input', {type: 'checkbox', 'aria-label': `cut ${name}`});
    swatch.style.background = color;
    shown.checked = cut.checked = true;
    opacity.value = '1';
    const label = make('label', {class: 'name', for: `show-${id}`}, name);
    if (material) label.title = material;
    const line = make('div', {class: 'structure'}, shown, swatch, label, opacity, make('label', {class: 'check'}, cut, 'cut'));
    shown.onchange = () => {
      surface.setShown(shown.checked);
      app.slices.setShown(id, shown.checked);
      app.redraw();
    };
    opacity.oninput = () => {
      surface.setOpacity(opacity.valueAsNumber);
      app.redraw();
    };
    cut.onchange = () => {
      surface.isCut = cut.checked;
      app.setCut();
      app.view.touch();
    };
    line.addEventListener('focusin', () => this.select(surface));
    return {surface, line, shown, name: name.toLowerCase()};
  }

  /** All that the filter leaves. */
  showAll(isShown) {
    for (const {shown, line} of this.rows) if (!line.hidden && shown.checked !== isShown) shown.click();
  }

  /** Leaves the rows whose name has all these words. */
  filter(text) {
    const words = text.toLowerCase().split(/\s+/).filter(Boolean);
    for (const row of this.rows) row.line.hidden = !words.every(word => row.name.includes(word));
    const left = this.rows.filter(row => !row.line.hidden).length;
    at('filter-words').textContent = `${left} of ${this.rows.length}`;
  }

  /** Makes a structure stand out, in the list and in the view; nothing: none. */
  select(surface) {
    if (surface === this.selected) return;
    this.selected = surface;
    for (const row of this.rows) {
      const isSelected = row.surface === surface;
      row.line.classList.toggle('selected', isSelected);
      if (isSelected) row.shown.setAttribute('aria-current', 'true');
      else row.shown.removeAttribute('aria-current');
      row.surface.setSelected(isSelected);
    }
    this.app.view.touch();
  }

  /** Of a click in the view: its row comes into sight, and its name is said. */
  find(surface) {
    this.select(surface);
    if (!surface) return;
    const {line} = this.rows.find(row => row.surface === surface);
    if (line.hidden) {
      at('filter').value = '';
      this.filter('');
    }
    at('structures').closest('details').open = true;
    const box = at('structures'), [row, list] = [line.getBoundingClientRect(), box.getBoundingClientRect()];
    if (row.top < list.top || row.bottom > list.bottom) box.scrollTop += row.top - list.top - (list.height - row.height) / 2;
    const {name, material} = surface.structure;
    this.app.announcer.say([name, material].filter(Boolean).join(', '));
  }
}
