// SPDX-License-Identifier: Apache-2.0
/** How long a picture takes, and from that how many facets it may have. */

const kMoving_ms = 33; // of a picture while something moves: 30 a second
const kMore = 1.4; // where a picture without facets takes longer than that: this much of it
const kStill_ms = 800; // of one picture when nothing moves any more
const kLast = 5; // measurements of a level whose median counts
const kOld_ms = 20000; // after which a level's measurements say nothing of now
const kChecks = 30; // pictures of a graphics card between measurements
const kFirst = 5; // measurements before the page is sure
// Until two levels were measured, ms of a facet: a graphics card's, and a program's (SwiftShader, two cores).
const kPerFacet_ms = {card: 1e-5, program: 8e-4};

const median = values => [...values].sort((a, b) => a - b)[values.length >> 1];

export class Pace {
  constructor(isSoftware) {
    this.isSoftware = isSoftware;
    this.guess_ms = isSoftware ? kPerFacet_ms.program : kPerFacet_ms.card;
    this.pictures = 0;
    this.skip = 2; // they compile shaders and upload
    this.levels = new Map(); // facets to the last measurements, ms, and their time
  }

  /** Whether more pictures are needed to know anything. */
  get isLearning() {
    return this.pictures < kFirst;
  }

  /** Whether to wait for the picture's end. That costs a graphics card its head start; a program has none. */
  get isDue() {
    return this.isSoftware || this.pictures < 2 * kFirst || this.pictures % kChecks === 0;
  }

  /** A picture with so many facets took so long. */
  measured(ms, facets, now) {
    if (this.skip > 0) {
      --this.skip;
      return;
    }
    ++this.pictures;
    const level = this.levels.get(facets) ?? {values: []};
    level.values = [...level.values.slice(1 - kLast), ms];
    level.at = now;
    this.levels.set(facets, level);
    this.mean_ms = median(level.values);
    for (const [count, {at}] of this.levels) if (now - at > kOld_ms) this.levels.delete(count);
  }

  /** Geometry is new: the next picture uploads it, and tells nothing. */
  changed() {
    this.skip = 1;
  }

  /** ms of a picture without facets and of each facet, by the fewest and the most that were drawn. */
  fit() {
    const counts = [...this.levels.keys()].sort((a, b) => a - b);
    if (counts.length === 0) return undefined;
    const [least, most] = [counts[0], counts.at(-1)];
    const [fast, slow] = [least, most].map(count => median(this.levels.get(count).values));
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
