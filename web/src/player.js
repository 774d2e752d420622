// SPDX-License-Identifier: Apache-2.0
/** Which frame is shown: plays, follows the newest one of a live loop, steps. */

export class Player {
  /** @param {import('./frames.js').FrameStore} frames */
  constructor(frames, isLive) {
    this.frames = frames;
    this.isLive = isLive;
    this.index = 0;
    this.speed = 1;
    this.playing = isLive; // live: follows
    this.time_s = 0;
  }

  get last() {
    return Math.max(0, this.frames.count - 1);
  }

  seek(index) {
    this.index = Math.min(Math.max(0, Math.round(index) || 0), this.last);
    this.time_s = this.frames.count ? this.frames.columns.time_s[this.index] : 0;
    if (this.isLive) this.playing = false;
  }

  step(frames) {
    this.playing = false;
    this.seek(this.index + frames);
  }

  toggle() {
    if (!this.playing && !this.isLive && this.index === this.last) this.seek(0);
    this.playing = !this.playing;
  }

  /** Moves on by the time since the last picture, s. */
  advance(elapsed_s) {
    if (!this.playing || this.frames.count === 0) return;
    if (this.isLive) {
      this.index = this.last;
      this.time_s = this.frames.columns.time_s[this.index];
      return;
    }
    this.time_s += elapsed_s * this.speed;
    this.index = this.frames.at(this.time_s);
    if (this.index === this.last) this.playing = false;
  }
}
