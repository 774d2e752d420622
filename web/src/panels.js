// SPDX-License-Identifier: Apache-2.0
/** The controls and words around the view. */
import {cssColor, forceColor, forceGradient, kTouchedShare} from './colors.js';
import {kGlyphColors} from './glyphs.js';
import {kViews, keyList} from './keys.js';
import {at, make} from './make.js';
import {download, markupsJson} from './markups.js';
import {StepPanel} from './step_panel.js';
import {StructureList} from './structure_list.js';
import {axisNames, listed, readable} from './words.js';

const kSpeeds = [[4, '4'], [2, '2'], [1, '1'], [0.5, '1/2'], [0.2, '1/5'], [0.1, '1/10'], [0.05, '1/20'],
                 [0.02, '1/50'], [0.01, '1/100']];

export class Panels {
  /** @param {import('./app.js').App} app */
  constructor(app) {
    this.app = app;
    this.names = axisNames(app.scene.axes);
    const {scene} = app;
    document.title = `Palpate: ${scene.title}`;
    document.querySelector('h1').textContent = `Palpate: ${scene.title}`;
    at('what').textContent = [scene.mode, scene.method && `method ${scene.method}`, !scene.choice && `${readable(scene.rate_hz)} Hz`,
                              scene.program].filter(Boolean).join(', ');
    this.buildView();
    this.buildTransport();
    this.structures = new StructureList(app);
    this.buildCut();
    this.buildLook();
    this.buildSlices();
    this.buildFelt();
    this.buildMarks();
    if (app.send && !scene.choice) this.buildLive();
    at('keys').replaceChildren(...keyList(app).flatMap(([key, words]) => [make('dt', {}, key), make('dd', {}, words)]));
  }

  buildView() {
    at('view-buttons').replaceChildren(...kViews.map(view => {
      const letter = (view.sign > 0 ? this.names.plus : this.names.minus)[view.axis];
      const button = make('button', {'aria-label': `Seen from ${this.names.word(letter)}`}, letter);
      button.onclick = () => this.app.view.lookFrom(view.from);
      return button;
    }));
    at('center').onclick = () => this.app.frames.count &&
      this.app.view.centerOn(this.app.frames.triple('proxy_m', this.app.player.index));
  }

  buildTransport() {
    const {app} = this, {player} = app;
    at('play').onclick = () => player.toggle();
    at('back').onclick = () => app.seekBy(-1);
    at('forth').onclick = () => app.seekBy(1);
    at('scrub').oninput = () => app.seek(at('scrub').valueAsNumber);
    at('speed').replaceChildren(...kSpeeds.map(([value, words]) => make('option', {value}, `× ${words}`)));
    at('speed').value = '1';
    at('speed').onchange = () => (player.speed = Number(at('speed').value));
    at('speed').closest('label').hidden = app.isLive;
    at('next-detail').hidden = !app.scene.details;
    at('next-detail').onclick = () => this.nextDetail();
    this.steps = new StepPanel(app);
  }

  /** To the next frame whose sub-steps are known, and after the last one to the first. */
  nextDetail() {
    const {app} = this, known = app.scene.details ?? {};
    const numbers = app.frames.columns.index.subarray(0, app.frames.count); // of rows: not without gaps
    const all = [...numbers.keys()].filter(i => known[numbers[i]]);
    if (all.length === 0) return;
    app.player.playing = false;
    app.seek(all.find(i => i > app.player.index) ?? all[0]);
    app.step = 0;
  }

  /** One speed slower (1) or faster (-1). */
  slower(direction) {
    const index = Math.min(Math.max(0, at('speed').selectedIndex + direction), kSpeeds.length - 1);
    at('speed').selectedIndex = index;
    this.app.player.speed = kSpeeds[index][0];
  }

  buildCut() {
    const {app} = this, radius = Math.ceil(app.view.radius);
    const sides = ['x', 'y', 'z'].flatMap((axis, i) => [[`+${axis}`, this.names.plus[i]], [`-${axis}`, this.names.minus[i]]]);
    at('cut-axis').append(...sides.map(([value, letter]) =>
      make('option', {value}, this.names.isPatient ? `from ${this.names.word(letter)}` : `from ${letter}`)));
    Object.assign(at('cut-place'), {min: -radius, max: radius, step: radius > 20 ? 1 : 0.1});
    const read = () => {
      app.cut = {axis: at('cut-axis').value, follows: at('cut-follows').checked,
                 place_mm: -at('cut-place').valueAsNumber};
      at('cut-place').disabled = app.cut.follows || app.cut.axis === 'none';
      at('cut-words').textContent = `${at('cut-place').value} mm`;
      app.setCut();
    };
    for (const id of ['cut-axis', 'cut-follows', 'cut-place']) at(id).addEventListener('input', read);
    read();
  }

  buildLook() {
    const {app} = this;
    const read = () => {
      app.look = {span: at('trail-span').value, by: at('trail-by').value, paint: at('paint').value};
      app.shown = undefined;
      app.repaint();
    };
    at('trail-span').value = app.look.span;
    for (const id of ['trail-span', 'trail-by', 'paint']) at(id).addEventListener('input', read);
  }

  showLegend() {
    const {look, scale_n, most, scene} = this.app;
    const key = (color, words) => {
      const swatch = make('span', {class: 'swatch'});
      swatch.style.background = color;
      return make('span', {class: 'key'}, swatch, words);
    };
    const rows = [make('div', {class: 'keys'}, key(kGlyphColors.probe, 'probe'), key(kGlyphColors.proxy, 'proxy'),
                       key(kGlyphColors.spring, 'spring'), key(kGlyphColors.force, 'force'),
                       key(kGlyphColors.mark, 'points'), ...(scene.details ? [key(kGlyphColors.plane, 'contact planes')] : []))];
    const ramp = (words, end) => {
      const bar = make('div', {class: 'ramp'});
      bar.style.background = forceGradient();
      return make('div', {}, words, bar, make('div', {class: 'ends'}, make('span', {}, '0'), make('span', {}, end)));
    };
    const isTrail = look.span !== 'off', newtons = `${readable(scale_n)} N or more`;
    if (isTrail && look.by === 'force') rows.push(ramp('Trail: force', newtons));
    if (isTrail && look.by === 'structure') rows.push(make('div', {}, 'Trail: colours of the structures'));
    if (isTrail) rows.push(make('div', {class: 'keys'}, key('rgb(140 153 168)', 'trail in the air')));
    if (look.paint === 'hardest') rows.push(ramp('Painted: the greatest force', newtons));
    if (look.paint === 'longest') rows.push(ramp('Painted: time', `${readable(most?.longest)} s or more`));
    if (look.paint === 'touched') rows.push(make('div', {class: 'keys'}, key(cssColor(forceColor(kTouchedShare)), 'painted: touched')));
    at('legend').replaceChildren(...rows);
  }

  buildSlices() {
    const {app} = this, {slices} = app;
    at('slices-panel').hidden = slices.isEmpty;
    if (slices.isEmpty) return;
    const choices = list => list.map((one, i) => make('option', {value: i}, one.name));
    at('volume-row').hidden = slices.volumes.length < 2;
    at('volume').replaceChildren(...choices(slices.volumes));
    at('volume').onchange = () => {
      slices.choose(Number(at('volume').value));
      this.beginWindow();
    };
    at('labels-row').hidden = slices.labelMaps.length === 0;
    at('labels').replaceChildren(...choices(slices.labelMaps), ...(slices.volumes.length ? [make('option', {value: -1}, 'none')] : []));
    at('labels').onchange = () => {
      slices.chooseLabels(Number(at('labels').value));
      app.redraw();
    };
    at('labels-opacity').hidden = slices.volumes.length === 0;
    at('labels-opacity').value = String(slices.opacity);
    at('labels-opacity').oninput = () => {
      slices.setOpacity(at('labels-opacity').valueAsNumber);
      app.redraw();
    };
    at('planes').onchange = () => {
      app.view.planes.setShown(at('planes').checked);
      app.redraw();
    };
    for (const id of ['window', 'level']) {
      at(id).closest('.row').hidden = slices.volumes.length === 0;
      at(id).oninput = () => this.setWindow();
    }
    this.pointAtSlices();
    this.beginWindow();
  }

  beginWindow() {
    const {slices} = this.app;
    if (!slices.volume) return;
    const {low, high} = slices.volume, [width, level] = slices.firstWindow();
    Object.assign(at('window'), {min: (high - low) / 500, max: high - low, step: 'any', value: width});
    Object.assign(at('level'), {min: low, max: high, step: 'any', value: level});
    this.setWindow();
  }

  setWindow() {
    const {slices} = this.app, [width, level] = [at('window').valueAsNumber, at('level').valueAsNumber];
    slices.setWindow(width, level);
    const unit = slices.volume.unit ?? '';
    at('window-words').textContent = `${readable(width, Infinity)} ${unit}`;
    at('level-words').textContent = `${readable(level, Infinity)} ${unit}`;
    this.app.redraw();
  }

  /** What is under the pointer in a slice is named, instead of what is at the proxy. */
  pointAtSlices() {
    const {slices} = this.app;
    at('slices').addEventListener('pointermove', event => {
      const slice = slices.slices.find(one => one.canvas === event.target);
      if (!slice?.isInside) return;
      const box = slice.canvas.getBoundingClientRect();
      const spot = [(event.clientX - box.left) * slice.width / box.width, (event.clientY - box.top) * slice.height / box.height];
      this.pointed = slice.grid.place(slice.indexAt(spot, slice.depth));
      this.showSliceWords();
    });
    at('slices').addEventListener('pointerleave', () => {
      this.pointed = undefined;
      this.showSliceWords();
    });
  }

  /** @param {number[]} [proxy_m] where that has moved */
  showSliceWords(proxy_m = this.proxy_m) {
    this.proxy_m = proxy_m;
    if (!proxy_m || this.app.slices.isEmpty) return;
    const words = `${this.pointed ? 'Under the pointer' : this.app.scene.choice ? 'At the cross' : 'At the proxy'}: ${this.app.slices.wordsAt(this.pointed ?? proxy_m)}`;
    if (at('slice-words').textContent !== words) at('slice-words').textContent = words;
  }

  buildFelt() {
    this.rows = this.app.felt.rows.map(row => {
      const cells = ['time', 'mean', 'most', 'area'].map(name => make('td', {'data-of': name}));
      const line = make('tr', {}, make('th', {scope: 'row'}, row.structure.name), ...cells);
      return {row, line, cells};
    });
    document.querySelector('#felt tbody').replaceChildren(...this.rows.map(entry => entry.line));
  }

  showFelt() {
    const {surfaces} = this.app.view;
    for (const {row, line, cells} of this.rows) {
      const surface = surfaces.byId(row.structure.id);
      const share = surface?.area ? 100 * surface.area.share : null;
      const values = [row.time_s, row.frames ? row.sum_n / row.frames : null, row.frames ? row.most_n : null, share];
      cells.forEach((cell, i) => {
        cell.textContent = readable(values[i]);
        cell.dataset.value = String(values[i]);
      });
      line.hidden = row.frames === 0;
    }
    const radius = surfaces.all.filter(s => s.area).map(s => s.area.radius_mm); // all alike
    const none = this.rows.every(entry => entry.row.frames === 0);
    at('felt-words').textContent = none ? 'Nothing was felt so far.'
      : 'Where several are felt at once, the whole force counts for each.' +
        (radius.length ? ` Area: within ${readable(Math.max(...radius))} mm of the proxy.` : '');
  }

  buildMarks() {
    const {app} = this;
    at('mark-form').onsubmit = event => {
      event.preventDefault();
      app.dropMark(at('mark-name').value.trim());
      at('mark-name').value = '';
    };
    at('markups').onclick = () => download(`${app.scene.title}.mrk.json`, markupsJson(app.marks, app.scene.axes));
  }

  showMarks() {
    const {app} = this;
    at('markups').disabled = app.marks.length === 0;
    at('marks').replaceChildren(...app.marks.map(mark => {
      const button = make('button', {}, mark.name);
      button.onclick = () => {
        if (!app.isLive && Number.isFinite(mark.time_s)) app.seek(app.frames.at(mark.time_s));
        app.view.centerOn(mark.at_m);
      };
      const words = [Number.isFinite(mark.time_s) && `${mark.time_s.toFixed(2)} s`, mark.felt ?? mark.label].filter(Boolean).join(', ');
      return make('li', {}, button, make('span', {}, words));
    }));
  }

  buildLive() {
    const {app} = this;
    at('live').hidden = false;
    at('freeze').onclick = () => app.send({do: 'freeze', on: !app.state.frozen});
    at('record').onclick = () => app.send({do: 'record', on: !app.state.recording});
    at('restart').onclick = () => app.send({do: 'restart'});
    at('hand').onclick = () => {
      app.hand.setOn(!app.hand.isOn);
      at('hand').setAttribute('aria-pressed', String(app.hand.isOn));
      app.view.canvas.focus({preventScroll: true});
    };
    at('space-mouse').onclick = () => this.toggleSpaceMouse();
    this.showSpaceMouse();
    at('gains').replaceChildren(...(app.scene.effects ?? []).flatMap(effect => effect.parts.map(part => {
      const words = effect.parts.length > 1 || part.name !== 'strength' ? `${effect.name}, ${part.name}` : effect.name;
      const slider = make('input', {type: 'range', min: 0, max: part.most, step: 0.01, 'aria-label': `gain of ${words}`,
                                    'data-effect': effect.id, 'data-part': part.name});
      const output = make('output', {'aria-live': 'off'}, readable(part.gain));
      slider.value = String(part.gain);
      slider.oninput = () => {
        output.textContent = readable(slider.valueAsNumber);
        app.send({do: 'gain', effect: effect.id, part: part.name, value: slider.valueAsNumber});
      };
      return make('div', {class: 'row gain'}, make('label', {}, words), slider, output);
    })));
    this.showState();
  }

  async toggleSpaceMouse() {
    const {spaceMouse, announcer} = this.app;
    this.usesSpaceMouse = !this.usesSpaceMouse;
    try {
      if (!this.usesSpaceMouse) spaceMouse.close();
      else if (!await spaceMouse.open()) this.usesSpaceMouse = false;
    } catch (error) { // a device file that this user may not open, say
      this.usesSpaceMouse = false;
      at('link').textContent = `The SpaceMouse cannot be opened: ${error.message}`;
      announcer.say(at('link').textContent);
    }
    this.showSpaceMouse();
  }

  showSpaceMouse() {
    const {app} = this;
    if (!app.panels) return; // not built yet
    if (!app.spaceMouse.device && !app.spaceMouse.pad) this.usesSpaceMouse = false;
    at('space-mouse').hidden = !app.state.mouse || !app.spaceMouse.isPossible;
    at('space-mouse').setAttribute('aria-pressed', String(Boolean(this.usesSpaceMouse)));
  }

  showState(wasRefused = false) {
    const {app} = this, {state} = app;
    if (!app.hand) return;
    at('hand').hidden = !state.mouse;
    this.showSpaceMouse();
    at('freeze').setAttribute('aria-pressed', String(Boolean(state.frozen)));
    at('record').setAttribute('aria-pressed', String(Boolean(state.recording)));
    for (const id of ['freeze', 'record', 'restart', 'button']) at(id).disabled = app.isConnected === false;
    for (const slider of at('gains').querySelectorAll('[data-effect]')) {
      const value = state.gains?.[slider.dataset.effect] ?? 1; // what is not told is as the scene has it
      if (slider === document.activeElement && !wasRefused) continue;
      slider.value = String(value);
      slider.nextSibling.textContent = readable(value);
    }
  }

  /** Says when no frame came for so many seconds, beside what was said last; 0: all is well. */
  showAge(seconds) {
    if (seconds === this.age) return;
    this.age = seconds;
    at('silence').hidden = !seconds;
    at('silence').textContent = seconds ? `no frame for ${seconds} s` : '';
  }

  showPlayer() {
    const {player, frames, isLive, view} = this.app;
    const words = isLive ? (player.playing ? 'Hold' : 'Follow') : player.playing ? 'Stop' : 'Play';
    if (at('play').textContent !== words) at('play').textContent = words;
    at('play').setAttribute('aria-pressed', String(player.playing));
    const scrub = at('scrub');
    if (Number(scrub.max) !== player.last) scrub.max = String(player.last);
    if (scrub.valueAsNumber !== player.index) scrub.value = String(player.index);
    const {pace, surfaces} = view;
    const rate = pace.mean_ms ? `${readable(1000 / pace.mean_ms)} pictures/s, ` : '';
    const facets = n => (n >= 1000 ? `${Math.round(n / 1000)}k` : String(n));
    const drawn = `${rate}${facets(surfaces.facets)} of ${facets(surfaces.mostFacets)} facets${view.drawer.isSoftware ? ', in software' : ''}`;
    if (at('pace').textContent !== drawn) at('pace').textContent = drawn;
    if (frames.count === 0) at('clock').textContent = 'no frames yet';
  }

  showFrame(i, felt, flags) {
    const {frames, scene, state, player} = this.app;
    const time = frames.columns.time_s[i];
    at('clock').textContent = `${time.toFixed(3)} s, frame ${frames.columns.index[i]}`;
    at('clock').dataset.value = String(time);
    at('scrub').setAttribute('aria-valuetext', `${time.toFixed(3)} s of ${frames.columns.time_s[player.last].toFixed(3)} s`);
    const put = (id, value, unit) => {
      at(id).textContent = `${readable(value)} ${unit}`;
      at(id).dataset.value = String(value);
    };
    put('force', frames.force(i), 'N');
    put('depth', 1000 * frames.depth(i), 'mm');
    at('pressed-row').hidden = !frames.isSoft;
    if (frames.isSoft) this.showPressed(i);
    at('touching').textContent = listed(felt.map(s => s.name)) || 'nothing';
    const device = [state.device ?? scene.device ?? 'unknown', state.device_ended && 'has ended', state.frozen && 'frozen',
                    state.recording && (state.file ? `recording to ${state.file.split('/').at(-1)}` : 'recording'),
                    frames.lost > 0 && `${frames.lost} frames lost on the way here`].filter(Boolean);
    at('device').textContent = device.join(', ');
    at('flags').textContent = flags.length ? flags.map(f => (f.remedy ? `${f.name}: ${f.remedy}` : f.name)).join('; ') : 'none';
  }

  /** Which soft surface is pressed in, how far, and how stiff it is there. */
  showPressed(i) {
    const {frames, scene} = this.app, {indentation_m, stiffness_n_per_m, pressed} = frames.columns;
    const surface = scene.structures?.find(s => s.bit >= 0 && s.bit + 1 === pressed[i]);
    at('pressed').textContent = pressed[i] === 0 ? 'nothing'
      : `${surface?.name ?? 'a surface'}: ${readable(1000 * indentation_m[i])} mm, ${readable(stiffness_n_per_m[i] / 1000)} N/mm`;
  }
}
