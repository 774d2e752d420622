// SPDX-License-Identifier: Apache-2.0
/** The device's first button, by the page: down while the control or the key is, up whatever happens to the page meanwhile. */

const kLeast_ms = 60; // that a press lasts, so that the loop sees it between two frames

export class DeviceButton {
  /** @param {HTMLElement} control @param {(command: any) => boolean} send */
  constructor(control, send) {
    this.control = control;
    this.send = send;
    this.isDown = false;
    control.addEventListener('pointerdown', event => event.button === 0 && this.press());
    control.addEventListener('keydown', event => {
      if (![' ', 'Enter'].includes(event.key)) return;
      event.preventDefault(); // no click besides
      if (!event.repeat) this.press();
    });
    control.addEventListener('keyup', event => [' ', 'Enter'].includes(event.key) && this.release());
    control.addEventListener('blur', () => this.release());
    control.addEventListener('click', event => { // of a screen reader: neither pointer nor key
      if (event.detail !== 0 || (this.isDown && this.timer === undefined)) return;
      this.press();
      this.release();
    });
    for (const name of ['pointerup', 'pointercancel', 'blur']) addEventListener(name, () => this.release());
    addEventListener('pagehide', () => this.isDown && this.lift()); // no timer runs afterwards
  }

  press() {
    if (this.timer !== undefined) this.lift(); // the press before is over, and each counts
    if (this.isDown || !this.send({do: 'button', on: true})) return;
    this.isDown = true;
    this.pressed = performance.now();
    this.show(true);
  }

  release() {
    if (!this.isDown || this.timer !== undefined) return;
    this.timer = setTimeout(() => this.lift(), Math.max(0, kLeast_ms - (performance.now() - this.pressed)));
  }

  lift() {
    clearTimeout(this.timer);
    this.timer = undefined;
    this.isDown = false;
    this.send({do: 'button', on: false});
    this.show(false);
  }

  show(isDown) {
    this.control.setAttribute('aria-pressed', String(isDown));
  }
}
