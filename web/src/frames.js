// SPDX-License-Identifier: Apache-2.0
/** The frames that were sent: columns that grow, with a bound on what is kept. */
import {DamagedData} from './container.js';

const kColumns = {
  time_s: ['f64', Float64Array, 1], probe_m: ['f64', Float64Array, 3],
  proxy_m: ['f64', Float64Array, 3], force_n: ['f64', Float64Array, 3],
  trial: ['u32', Uint32Array, 1], flags: ['u32', Uint32Array, 1], felt: ['u32', Uint32Array, 1],
  sub_steps: ['u32', Uint32Array, 1], spent_us: ['f32', Float32Array, 1],
  late_us: ['f32', Float32Array, 1],
};
// Sent where a soft surface is pressed in; before the first of them nothing is kept of it.
const kSoftColumns = {
  indentation_m: ['f32', Float32Array, 1], stiffness_n_per_m: ['f32', Float32Array, 1],
  pressed: ['u32', Uint32Array, 1], // 1 + the bit of the surface; 0: none
  front_m: ['f64', Float64Array, 3], // its place from which it is pressed in; else the proxy
};
const kKept = {...kColumns, index: ['', Uint32Array, 1]}; // besides: the number that the loop counts for a frame
const kLiveFrames = 600000; // kept of a live loop: 10 minutes at 1 kHz, 60 MB

export class FrameStore {
  constructor() {
    this.clear();
  }

  clear() {
    this.count = 0; // frames here
    this.lost = 0; // frames that the page never got
    this.generation = (this.generation ?? 0) + 1; // changes where earlier frames are gone
    this.columns = {};
    this.isSoft = false; // whether a soft surface was ever pressed in
    this.reserve(0);
  }

  get kept() {
    return this.isSoft ? {...kKept, ...kSoftColumns} : kKept;
  }

  reserve(count) {
    if (this.capacity >= count && this.columns.time_s) return;
    this.capacity = Math.max(count, 2 * this.count, 1024);
    for (const [name, [, Type, width]] of Object.entries(this.kept)) {
      const grown = new Type(this.capacity * width);
      if (this.columns[name]) grown.set(this.columns[name].subarray(0, this.count * width));
      this.columns[name] = grown;
    }
  }

  /**
   * Adds frames behind those here.
   * @param {any} frames the entry "frames" of the description
   * @param {(name: string, count: number, type: string) => any} blob
   */
  append(frames, blob) {
    const count = frames.count;
    if (!Number.isSafeInteger(count) || count < 0)
      throw new DamagedData(`"frames" has the count ${count}.`);
    const arrived = {};
    for (const [name, [type, , width]] of Object.entries(kColumns)) {
      const source = frames.columns?.[name];
      if (source !== undefined) arrived[name] = blob(source, count * width, type);
      else if (type === 'f64') throw new DamagedData(`"frames" has no column "${name}".`);
    }
    for (const [name, [type, , width]] of Object.entries(kSoftColumns)) {
      const source = frames.columns?.[name];
      if (source !== undefined) arrived[name] = blob(source, count * width, type);
    }
    const number = frames.columns?.number; // of frames between which some were not recorded
    const numbers = number === undefined ? undefined : blob(number, count, 'u32');
    this.lost += frames.lost ?? 0;
    this.reserve(this.count + count);
    if (arrived.front_m && !this.isSoft) this.beginSoft();
    for (const [name, [, , width]] of Object.entries(kColumns))
      if (arrived[name]) this.columns[name].set(arrived[name], this.count * width);
      else this.columns[name].fill(0, this.count * width, (this.count + count) * width);
    if (this.isSoft)
      for (const [name, [, , width]] of Object.entries(kSoftColumns)) {
        const to = this.columns[name], begin = this.count * width;
        if (arrived[name]) to.set(arrived[name], begin);
        else if (name === 'front_m') to.set(arrived.proxy_m, begin);
        else to.fill(0, begin, begin + count * width);
      }
    for (let i = 0; i < count; ++i) this.columns.index[this.count + i] = numbers ? numbers[i] : (frames.first ?? 0) + i;
    this.count += count;
  }

  /** The first soft surface is pressed in: until now the front was the proxy. */
  beginSoft() {
    this.isSoft = true;
    for (const [name, [, Type, width]] of Object.entries(kSoftColumns))
      this.columns[name] = new Type(this.capacity * width);
    this.columns.front_m.set(this.columns.proxy_m.subarray(0, 3 * this.count));
  }

  /** Whether more frames are here than a live page keeps. */
  get isFull() {
    return this.count > kLiveFrames;
  }

  /** Where the last run begins among the frames from `from` on: its clock begins anew. 0: nowhere. */
  runBegin(from) {
    const {time_s} = this.columns;
    for (let i = this.count - 1; i >= Math.max(1, from); --i) if (time_s[i] < time_s[i - 1]) return i;
    return 0;
  }

  /** Forgets so many of the oldest frames. */
  forget(gone) {
    for (const [name, [, , width]] of Object.entries(this.kept))
      this.columns[name].copyWithin(0, gone * width, this.count * width);
    this.count -= gone;
    this.generation += 1;
  }

  /** Three numbers of a column, exactly as they were sent. */
  triple(name, i) {
    return [...this.columns[name].subarray(3 * i, 3 * i + 3)];
  }

  /** Length of the force, N. */
  force(i) {
    const f = this.columns.force_n;
    return Math.hypot(f[3 * i], f[3 * i + 1], f[3 * i + 2]);
  }

  /** Where the proxy is on the surface with this bit of `felt`: the front of one that is soft. */
  placeOn(bit, i) {
    const {proxy_m, front_m, pressed} = this.columns;
    return (pressed?.[i] === bit + 1 ? front_m : proxy_m).subarray(3 * i, 3 * i + 3);
  }

  /** Distance from probe to proxy, or to the front of the soft surface that is pressed in, m. */
  depth(i) {
    const {probe_m: a, proxy_m} = this.columns, b = this.columns.front_m ?? proxy_m;
    return Math.hypot(a[3 * i] - b[3 * i], a[3 * i + 1] - b[3 * i + 1], a[3 * i + 2] - b[3 * i + 2]);
  }

  /** Time that frame i stands for, s: a period while the device's own time stands still, and what stood still is not counted
   *  again; up to the next period where frames before it are missing. */
  duration(i, period_s) {
    if (i === 0) return period_s;
    const {time_s} = this.columns, passed = time_s[i] - time_s[i - 1];
    if (passed === 0) return period_s;
    let stood_s = 0;
    for (let k = i - 1; k > 0 && time_s[k] === time_s[k - 1]; --k) stood_s += period_s;
    return passed > 0 ? Math.min(Math.max(passed - stood_s, 0), 2 * period_s) : 0;
  }

  /** The last frame that is not after this time; 0 before the first. */
  at(time_s) {
    let low = 0, high = this.count - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.columns.time_s[middle] <= time_s) low = middle;
      else high = middle - 1;
    }
    return low;
  }
}
