// SPDX-License-Identifier: Apache-2.0
/** When the page works: before each picture of the screen while something changes, seldom while nothing does. */

const kRest_ms = 100; // between two looks at rest; what the reader or the loop does ends it at once
const kReader = ['pointerdown', 'pointermove', 'pointerup', 'wheel', 'keydown', 'keyup', 'input', 'change'];

export class Beat {
  /** @param {(now: number, elapsed_s: number) => boolean} work gives back whether the next picture may look different */
  constructor(work) {
    this.work = work;
    this.before = performance.now();
    for (const kind of kReader) addEventListener(kind, () => this.wake(), {capture: true, passive: true});
    this.next();
  }

  /** Something has changed: no rest before the next picture. */
  wake() {
    if (this.rest === undefined) return;
    clearTimeout(this.rest);
    this.before = performance.now(); // the rest is over: what begins now begins at once, not before
    this.next();
  }

  next() {
    this.rest = undefined;
    requestAnimationFrame(now => {
      const elapsed_s = Math.max(0, now - this.before) / 1000;
      this.before = now;
      if (this.work(now, elapsed_s)) this.next();
      else this.rest = setTimeout(() => this.next(), kRest_ms);
    });
  }
}
