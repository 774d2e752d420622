// SPDX-License-Identifier: Apache-2.0
/** How long a picture takes, and from that how many facets it may have. */

const kMoving_ms = 33; // of a picture while something moves: 30 a second
const kStill_ms = 600; // of one picture when nothing moves any more
const kMix = 0.3; // of a new measurement in the mean
const kChecks = 40; // pictures between measurements, once there are enough

export class Pace {
  constructor() {
    this.fixed_ms = 4; // of a picture without any facet; refined by what is measured
    this.perFacet_ms = undefined;
    this.pictures = 0;
    this.skip = 2; // compiles shaders, uploads
  }

  /** Whether to wait for the picture's end: that costs a GPU its head start. */
  get isDue() {
    return this.pictures < 12 || this.pictures % kChecks === 0;
  }

  /** A picture with so many facets took so long. */
  measured(ms, facets) {
    ++this.pictures;
    this.last_ms = ms;
    if (this.skip > 0) {
      --this.skip;
      return;
    }
    const each = ms / Math.max(1, facets);
    this.perFacet_ms = this.perFacet_ms === undefined ? each : (1 - kMix) * this.perFacet_ms + kMix * each;
    this.mean_ms = this.mean_ms === undefined ? ms : (1 - kMix) * this.mean_ms + kMix * ms;
  }

  /** Geometry is new: the next picture uploads it, and tells nothing. */
  changed() {
    this.skip = Math.max(this.skip, 1);
    this.mean_ms = undefined;
    this.pictures = Math.min(this.pictures, 6);
  }

  /** Facets that a picture may have, while something moves or when all is still. */
  budget(isStill) {
    if (this.perFacet_ms === undefined) return 0;
    return (isStill ? kStill_ms : kMoving_ms) / this.perFacet_ms;
  }
}
