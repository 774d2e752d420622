// SPDX-License-Identifier: Apache-2.0
/** Numbers and states in words. */

const kDecimals = 3; // at most: a thousandth of a N, a mm, a s
const kMostDecimals = 20; // that toFixed() is sure to have

/** Three significant digits, all digits before the point; a dash where there is no number.
 *  @param {number} decimals at most: what is finer says nothing of a force, a way, a time */
export function readable(value, decimals = kDecimals) {
  if (value === null || value === undefined || !Number.isFinite(value)) return '–';
  if (value === 0) return '0';
  const digits = Math.max(0, 2 - Math.floor(Math.log10(Math.abs(value))));
  return value.toFixed(Math.min(digits, decimals, kMostDecimals));
}

/** The smallest of 1, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10 times a power of ten that is at least `value`. */
export function roundUp(value) {
  if (!(value > 0) || !Number.isFinite(value)) return 1;
  const power = 10 ** Math.floor(Math.log10(value));
  for (const step of [1, 1.5, 2, 2.5, 3, 4, 5, 6, 8])
    if (value <= step * power * (1 + 1e-9)) return step * power;
  return 10 * power;
}

/** "a", "a and b", "a, b and c". */
export function listed(words) {
  if (words.length < 2) return words.join('');
  return `${words.slice(0, -1).join(', ')} and ${words.at(-1)}`;
}

/** Flags of a frame: those of the scene that are set, and bits without a name. */
export function flagsOf(scene, flags) {
  const named = (scene.flags ?? []).filter(flag => (flags >>> flag.bit) & 1);
  const known = named.reduce((bits, flag) => bits | (1 << flag.bit), 0);
  const rest = (flags & ~known) >>> 0;
  return rest ? [...named, {name: `bits 0x${rest.toString(16)}`, remedy: ''}] : named;
}

const kOthers = {name: 'another surface', bit: 31}; // of all that have no bit of their own

/** Structures that a frame felt. */
export function feltOf(scene, felt) {
  const named = (scene.structures ?? []).filter(s => s.bit >= 0 && (felt >>> s.bit) & 1);
  return (felt >>> kOthers.bit) & 1 ? [...named, kOthers] : named;
}

/** Letters and words of the axes: of the patient for "LPS" and "RAS", else of x, y and z. */
export function axisNames(axes) {
  const patient = {L: 'left', R: 'right', P: 'behind', A: 'the front', S: 'above', I: 'below'};
  const opposite = {L: 'R', R: 'L', P: 'A', A: 'P', S: 'I', I: 'S'};
  const isPatient = /^[LR][PA][SI]$/.test(axes ?? '');
  const plus = isPatient ? [...axes] : ['+x', '+y', '+z'];
  const minus = isPatient ? plus.map(letter => opposite[letter]) : ['−x', '−y', '−z'];
  const word = letter => {
    const name = patient[letter] ?? letter;
    return name === 'left' || name === 'right' ? `the ${name}` : name;
  };
  return {plus, minus, isPatient, word};
}

/** Letters of a direction, the strongest first: those with at least 0.38 of its length (sin 22.5°). */
export function lettersOf(direction, names) {
  return direction
    .map((part, i) => ({size: Math.abs(part), letter: part > 0 ? names.plus[i] : names.minus[i]}))
    .filter(entry => entry.size > 0.38)
    .sort((a, b) => b.size - a.size)
    .map(entry => entry.letter);
}

/** Says things to screen readers, at most one a second: the newest counts. */
export class Announcer {
  constructor(element) {
    this.element = element;
    this.next = 0;
    this.timer = 0;
  }

  say(words) {
    if (words === this.words) return;
    this.words = words;
    clearTimeout(this.timer);
    const wait = Math.max(0, this.next - performance.now());
    this.timer = setTimeout(() => {
      this.element.textContent = words;
      this.next = performance.now() + 1000;
    }, wait);
  }
}
