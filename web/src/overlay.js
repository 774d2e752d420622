// SPDX-License-Identifier: Apache-2.0
/** Words over the view: directions of the patient, the force at its arrow, names of points, scale. */
import * as THREE from 'three';
import {axisNames, lettersOf, listed, readable, roundUp} from './words.js';

const covers = (a, b) => a.x < b.right + 2 && b.x < a.right + 2 && a.y < b.bottom + 1 && b.y < a.bottom + 1;
const kBar_px = 110; // the scale bar is at most as long

/** A round length in mm as its bar says it, in um where mm would have many zeros. */
function barLength(length_mm) {
  const isSmall = length_mm < 0.1;
  return `${Number((isSmall ? 1000 * length_mm : length_mm).toPrecision(6))} ${isSmall ? '\u00b5m' : 'mm'}`;
}

export class Overlay {
  constructor(view, scene) {
    this.view = view;
    this.names = axisNames(scene.axes);
    this.barPlace = scene.choice ? 'middle' : 'proxy';
    const at = selector => view.host.querySelector(selector);
    this.edges = {west: at('.west'), east: at('.east'), north: at('.north'), south: at('.south')};
    this.force = at('#arrow-words');
    this.marks = at('#mark-words');
    this.bar = at('#scale-bar i');
    this.barWords = at('#scale-bar span');
    this.from = at('#seen-from');
  }

  setForce(force_n) {
    this.force_n = force_n;
    this.force.dataset.value = String(force_n);
  }

  setMarks(marks) {
    this.places = marks.map(mark => new THREE.Vector3(...this.view.toView(mark.at_m)));
    this.marks.replaceChildren(...marks.map(mark => {
      const words = document.createElement('span');
      words.textContent = mark.name;
      return words;
    }));
  }

  /** After each picture: the camera may have moved. */
  place() {
    const {view} = this, [right, up, towards] = view.axes();
    const minus = v => v.map(x => -x);
    const letters = direction => lettersOf(direction, this.names).join('');
    this.edges.east.textContent = letters(right);
    this.edges.west.textContent = letters(minus(right));
    this.edges.north.textContent = letters(up);
    this.edges.south.textContent = letters(minus(up));
    const from = lettersOf(towards, this.names);
    this.from.textContent = `Seen from ${this.names.isPatient
      ? `${listed(from.map(this.names.word))} (${from.join('')})` : from.join(' ')}`;
    this.placeScale();
    this.placeForce();
    this.placeMarks();
  }

  placeScale() {
    const perPixel = this.view.mmPerPixel(this.view.glyphs.group.visible ? this.view.glyphs.proxy.position
                                                                         : this.view.controls.target);
    let length = roundUp(kBar_px * perPixel);
    while (length > kBar_px * perPixel * 1.001) length = length > 1e-9 ? roundUp(length * 0.45) : 0;
    this.bar.style.width = `${length / perPixel}px`;
    this.barWords.textContent = `${barLength(length)} at the ${this.barPlace}`;
  }

  /** A tag beside a place, within the view, where it covers no other; hidden where there is no room.
   *  True where it is shown.
   *  @param {[number, number]} away where the tag stands best from the place, px, x to the right, y down */
  put(tag, place, away = [1, -1]) {
    const spot = place && this.view.toScreen(place);
    tag.style.visibility = 'hidden';
    if (!spot) return false;
    const {clientWidth: width, clientHeight: height} = this.view.host;
    const [w, h] = [tag.offsetWidth, tag.offsetHeight];
    const spots = [[12, -26], [12, 8], [-12 - w, -26], [-12 - w, 8], [-w / 2, -44], [-w / 2, 24]];
    const along = ([dx, dy]) => {
      const middle = [dx + w / 2, dy + h / 2];
      return (middle[0] * away[0] + middle[1] * away[1]) / Math.hypot(...middle);
    };
    for (const [dx, dy] of spots.sort((a, b) => along(b) - along(a))) {
      const box = {x: spot.x + dx, y: spot.y + dy, right: spot.x + dx + w, bottom: spot.y + dy + h};
      const isInside = box.x >= 0 && box.y >= 0 && box.right <= width && box.bottom <= height;
      if (!isInside || this.taken.some(other => covers(box, other))) continue;
      tag.style.transform = `translate(${Math.round(box.x)}px, ${Math.round(box.y)}px)`;
      tag.style.visibility = '';
      this.taken.push(box);
      return true;
    }
    return false;
  }

  /** What stands at the view's edges. */
  takeEdges() {
    this.taken = [...this.view.host.querySelectorAll('.edge, .corner')].map(element => {
      const {offsetLeft: x, offsetTop: y, offsetWidth: w, offsetHeight: h} = element;
      return {x, y, right: x + w, bottom: y + h};
    });
  }

  placeForce() {
    const {glyphs} = this.view;
    const isShown = glyphs.group.visible && glyphs.arrow.visible;
    this.force.textContent = isShown ? `${readable(this.force_n)} N` : '';
    this.takeEdges();
    const [from, to] = isShown ? [glyphs.proxy.position, glyphs.tip].map(place => this.view.toScreen(place)) : [];
    const away = from && to ? [to.x - from.x, to.y - from.y] : undefined;
    if (!this.put(this.force, to && glyphs.tip, away)) this.put(this.force, from && glyphs.proxy.position);
  }

  /** Names of points; one without room is left out, and stands in the list. */
  placeMarks() {
    [...this.marks.children].forEach((tag, i) => this.put(tag, this.places[i]));
  }
}
