// SPDX-License-Identifier: Apache-2.0
/** What the frames so far felt, by structure: time, mean and greatest force. */

export class Felt {
  constructor(scene) {
    this.period_s = 1 / (scene.rate_hz || 1000);
    this.rows = (scene.structures ?? []).filter(s => s.bit >= 0)
      .map(structure => ({structure, time_s: 0, frames: 0, sum_n: 0, most_n: 0, at: -1}));
    this.clear();
  }

  clear() {
    this.done = 0;
    for (const row of this.rows) Object.assign(row, {time_s: 0, frames: 0, sum_n: 0, most_n: 0, at: -1});
  }

  /** Takes in the frames that came since the last time. The force of a frame counts whole for each
   *  structure that it felt. */
  update(frames) {
    const {felt} = frames.columns;
    for (let i = this.done; i < frames.count; ++i) {
      if (felt[i] === 0) continue;
      const force = frames.force(i), time = frames.duration(i, this.period_s);
      for (const row of this.rows) {
        if (!((felt[i] >>> row.structure.bit) & 1)) continue;
        row.time_s += time;
        row.frames += 1;
        row.sum_n += force;
        if (row.at < 0 || force > row.most_n) {
          row.most_n = force;
          row.at = frames.columns.index[i];
        }
      }
    }
    this.done = frames.count;
  }
}
