// SPDX-License-Identifier: Apache-2.0
/** How long a picture takes, and from that how many facets it may have. */

const kMoving_ms = 33; // of a picture while something moves: 30 a second
const kMore = 1.4; // where a picture without facets takes longer than that: this much of it
const kStill_ms = 800; // of one picture when nothing moves any more
const kMix = 0.3; // of a new measurement in the mean
const kChecks = 30; // pictures between measurements, once there are enough
const kFirst = 4; // measurements before the page is sure
// Until two levels were measured, ms of a facet: a graphics card's, and a program's (SwiftShader, two cores).
const kPerFacet_ms = {card: 1e-5, program: 8e-4};

export class Pace {
  constructor(isSoftware) {
    this.guess_ms = isSoftware ? kPerFacet_ms.program : kPerFacet_ms.card;
    this.pictures = 0;
    this.skip = 1; // compiles shaders, uploads
    this.means = new Map(); // facets to ms
  }

  /** Whether more pictures are needed to know anything. */
  get isLearning() {
    return this.pictures < kFirst + 1;
  }

  /** Whether to wait for the picture's end: that costs a graphics card its head start. */
  get isDue() {
    return this.pictures < 12 || this.pictures % kChecks === 0;
  }

  /** A picture with so many facets took so long. */
  measured(ms, facets) {
    ++this.pictures;
    if (this.skip > 0) {
      --this.skip;
      return;
    }
    const before = this.means.get(facets);
    this.mean_ms = before === undefined ? ms : (1 - kMix) * before + kMix * ms;
    this.means.set(facets, this.mean_ms);
  }

  /** Geometry is new: the next picture uploads it, and tells nothing. */
  changed() {
    this.skip = 1;
    this.pictures = Math.min(this.pictures, 8);
  }

  /** ms of a picture without facets and of each facet, by the fewest and the most that were drawn. */
  fit() {
    const counts = [...this.means.keys()].sort((a, b) => a - b);
    if (counts.length === 0) return undefined;
    const [least, most] = [counts[0], counts.at(-1)];
    const [fast, slow] = [this.means.get(least), this.means.get(most)];
    const each = most > 1.5 * least ? Math.max((slow - fast) / (most - least), this.guess_ms / 10) : this.guess_ms;
    return {each, fixed: Math.max(0, fast - each * least)};
  }

  /** Facets that a picture may have, while something moves or when all is still. */
  budget(isStill) {
    const fit = this.fit();
    if (!fit || this.isLearning) return 0;
    const limit = isStill ? kStill_ms : Math.max(kMoving_ms, kMore * fit.fixed);
    return Math.max(0, limit - fit.fixed) / fit.each;
  }
}
