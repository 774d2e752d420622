// SPDX-License-Identifier: Apache-2.0
/** The list of a frame's sub-steps in words, and the legend of what is drawn of one. */
import {kGlyphColors} from './ink.js';
import {at, make} from './make.js';
import {stepDetails, stepInWords} from './step_words.js';

const kKeys = [
  ['proxy', 'way of the proxy, to the full ball'], ['plane', 'what it was led to; thin: where forces balance; discs: planes'],
  ['probe', 'where probe and forces draw it'], ['stop', 'where a move was stopped'],
  ['leash', 'guard, leash and its plane'], ['cone', 'cone of friction: it holds while what draws the proxy is inside'],
];

const kLeastRadius_mm = 0.02; // of what fills the view: surfaces are drawn no finer

export class StepPanel {
  /** @param {import('./app.js').App} app */
  constructor(app) {
    this.app = app;
    at('step-back').onclick = () => this.stepBy(-1);
    at('step-forth').onclick = () => this.stepBy(1);
    at('step-zoom').onclick = () => this.zoom();
    at('step-legend').replaceChildren(...kKeys.map(([color, words]) => {
      const swatch = make('span', {class: 'swatch'});
      swatch.style.background = kGlyphColors[color];
      return make('span', {class: 'key'}, swatch, words);
    }));
  }

  stepBy(steps) {
    this.stepTo(this.app.step + steps);
  }

  stepTo(step) {
    const {app} = this, all = app.detail();
    if (!all) return;
    app.player.playing = false;
    app.step = Math.min(Math.max(0, step), all.length - 1);
  }

  /** Fills the view with the way of the proxy in this frame. */
  zoom() {
    const steps = this.app.detail();
    if (!steps) return;
    const places = steps.flatMap(step => [step.proxy_m, step.to_m, step.wanted_m, step.stop?.at_m].filter(Boolean));
    const middle = [0, 1, 2].map(i => (Math.min(...places.map(p => p[i])) + Math.max(...places.map(p => p[i]))) / 2);
    const radius_m = Math.max(...places.map(p => Math.hypot(...p.map((v, i) => v - middle[i]))));
    this.app.view.fill(middle, Math.max(1000 * radius_m, kLeastRadius_mm));
  }

  show(steps, step) {
    at('steps').hidden = at('steps-panel').hidden = !steps;
    if (!steps) {
      this.shown = undefined;
      return;
    }
    const {structures} = this.app.scene;
    at('step-words').textContent = `sub-step ${step + 1} of ${steps.length}: ${stepInWords(steps[step], structures)}`;
    if (this.shown !== steps) {
      this.shown = steps;
      at('step-list').replaceChildren(...steps.map((one, i) => {
        const button = make('button', {class: 'step'}, stepInWords(one, structures));
        button.onclick = () => this.stepTo(i);
        return make('li', {}, button);
      }));
    }
    [...at('step-list').children].forEach((item, i) =>
      i === step ? item.setAttribute('aria-current', 'step') : item.removeAttribute('aria-current'));
    at('step-details').replaceChildren(...stepDetails(steps[step], structures).map(words => make('li', {}, words)));
  }
}
