// SPDX-License-Identifier: Apache-2.0
/** The mouse, the keyboard and a SpaceMouse as a device: drag in the view's plane, wheel and page keys along it; or a cap's push. */

const kKeyStep_m = 0.0005;
const kFineStep_m = 0.0001; // with Alt
const kWheel_m = 0.0005; // of one notch, 100 px
const kCap_m_per_s = 0.1; // with a cap that is pushed all the way, as the driver of one has it
const kLongest_s = 0.05; // of a cap's push at a time: after a pause the hand does not jump

export class Hand {
  /**
   * @param {import('./view3d.js').View3d} view
   * @param {(command: any) => boolean} send
   * @param {() => number[] | undefined} probe where the loop's probe is, scene m
   */
  constructor(view, send, probe) {
    this.view = view;
    this.send = send;
    this.probe = probe;
    this.isOn = false;
    const {canvas} = view;
    canvas.addEventListener('pointerdown', event => this.down(event), true);
    canvas.addEventListener('pointermove', event => this.move(event), true);
    canvas.addEventListener('pointerup', () => (this.last = undefined), true);
    canvas.addEventListener('pointercancel', () => (this.last = undefined), true);
    canvas.addEventListener('wheel', event => this.wheel(event), {capture: true, passive: false});
  }

  setOn(isOn) {
    this.isOn = isOn;
    this.view.controls.enabled = !isOn;
    this.view.canvas.classList.toggle('hand', isOn);
    this.forget();
  }

  /** The next move is from the probe on, whoever moved it meanwhile. */
  forget() {
    this.place = undefined;
    this.isMoved = false;
  }

  /** Moves by metres along the view's axes: right, up, towards the viewer. */
  by(right_m, up_m, towards_m) {
    this.place ??= this.probe();
    if (!this.place) return;
    const [x, y, z] = this.view.axes();
    this.place = this.place.map((v, i) => v + right_m * x[i] + up_m * y[i] + towards_m * z[i]);
    this.isMoved = true;
  }

  down(event) {
    if (!this.isOn || event.button !== 0) return;
    this.last = [event.clientX, event.clientY];
    this.view.canvas.setPointerCapture(event.pointerId);
    this.view.canvas.focus({preventScroll: true});
    event.stopImmediatePropagation();
  }

  move(event) {
    if (!this.isOn || !this.last) return;
    const scale = this.view.mmPerPixel(this.view.glyphs.probe.position) / 1000;
    this.by((event.clientX - this.last[0]) * scale, (this.last[1] - event.clientY) * scale, 0);
    this.last = [event.clientX, event.clientY];
  }

  wheel(event) {
    if (!this.isOn) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    const pixels = event.deltaMode === 1 ? 33 * event.deltaY : event.deltaY;
    this.by(0, 0, kWheel_m * pixels / 100); // away from the reader's finger is into the picture
  }

  /** A cap's push for so long: its length is at most 1, along the view's axes. */
  drive([right, up, towards], seconds) {
    const isPushed = right !== 0 || up !== 0 || towards !== 0;
    if (isPushed && !this.isDriven) this.place = undefined; // from the probe on
    this.isDriven = isPushed;
    const step = kCap_m_per_s * Math.min(seconds, kLongest_s);
    if (isPushed) this.by(step * right, step * up, step * towards);
  }

  /** True where the key was the hand's. */
  key(event) {
    if (!this.isOn) return false;
    const step = event.altKey ? kFineStep_m : kKeyStep_m;
    const ways = {ArrowLeft: [-step, 0, 0], ArrowRight: [step, 0, 0], ArrowUp: [0, step, 0],
                  ArrowDown: [0, -step, 0], PageUp: [0, 0, -step], PageDown: [0, 0, step]};
    if (!ways[event.key]) return false;
    this.by(...ways[event.key]);
    return true;
  }

  /** Sends where the hand is, at most once a picture. */
  flush() {
    if (!this.isMoved) return;
    this.isMoved = false;
    this.send({do: 'probe', at_m: this.place});
  }
}
