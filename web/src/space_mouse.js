// SPDX-License-Identifier: Apache-2.0
/** A 3Dconnexion cap at the page's own computer: by WebHID, or as a gamepad where a browser has only that. */

const kVendors = [0x046d, 0x256f]; // Logitech's, 3Dconnexion's
const kFilters = kVendors.map(vendorId => ({vendorId, usagePage: 0x01, usage: 0x08})); // multi-axis controllers
const kPad = /3dconnexion|space ?(mouse|navigator|pilot|explorer)|(046d|256f).*(c62[0-9a-f]|c63[0-9a-f]|c65[0-9a-f])/i;
const kFull = 350; // of a cap's axis, as every model says; real ones go beyond
const kDead = 0.05; // of the full deflection that counts as none
const kSilence_ms = 100; // a deflected cap says so every 8 to 16 ms
const [kTranslation, kButtons] = [1, 3]; // ids of reports

/** 0 in the dead zone of each axis, from there on without a step, of a length of at most 1. */
function beyond(push) {
  const each = push.map(v => Math.sign(v) * Math.min(1, Math.max(0, Math.abs(v) - kDead) / (1 - kDead)));
  const length = Math.hypot(...each);
  return length > 1 ? each.map(v => v / length) : each;
}

export class SpaceMouse {
  /** @param {(isDown: boolean) => void} onButton its first button @param {() => void} onChange one came or went */
  constructor(onButton, onChange) {
    this.onButton = onButton;
    this.onChange = onChange;
    this.push = [0, 0, 0];
    this.isDown = false;
    navigator.hid?.addEventListener('disconnect', event => event.device === this.device && this.close());
    addEventListener('gamepadconnected', () => this.onChange());
    addEventListener('gamepaddisconnected', () => {
      if (!this.device && !this.pad) this.setButton(false);
      this.onChange();
    });
  }

  /** Whether a page may ask for one: the browser has WebHID, or has shown a cap as a gamepad. */
  get isPossible() {
    return Boolean(navigator.hid) || Boolean(this.pad);
  }

  get pad() {
    return navigator.getGamepads?.().find(pad => pad && kPad.test(pad.id)) ?? undefined;
  }

  /** Asks the reader for it, once; from then on it is read. Only on a click. True where there is one. */
  async open() {
    if (!navigator.hid) return Boolean(this.pad);
    const isOurs = device => kVendors.includes(device.vendorId) &&
                             device.collections.some(one => one.usagePage === 0x01 && one.usage === 0x08);
    const known = (await navigator.hid.getDevices()).filter(isOurs);
    const [device] = known.length ? known : await navigator.hid.requestDevice({filters: kFilters});
    if (!device) return Boolean(this.pad);
    if (!device.opened) await device.open();
    this.device = device;
    device.oninputreport = event => this.take(event.reportId, event.data);
    return true;
  }

  close() {
    if (this.device) {
      this.device.oninputreport = null;
      this.device.close();
      this.device = undefined;
    }
    this.push = [0, 0, 0];
    this.setButton(false);
    this.onChange();
  }

  /** A report without its id. What is shorter or of another kind changes nothing. */
  take(id, data) {
    if (id === kTranslation && data.byteLength >= 6) {
      this.push = [0, 2, 4].map(at => Math.min(1, Math.max(-1, data.getInt16(at, true) / kFull)));
      this.heard = performance.now();
    }
    if (id === kButtons && data.byteLength >= 1) this.setButton((data.getUint8(0) & 1) === 1);
  }

  setButton(isDown) {
    if (isDown === this.isDown) return;
    this.isDown = isDown;
    this.onButton(isDown);
  }

  /** How far it is pushed: right, up, towards the reader, -1 to 1. The cap counts right, towards, down. */
  deflection(now) {
    const pad = this.device ? undefined : this.pad;
    if (pad) {
      this.push = [0, 1, 2].map(axis => pad.axes[axis] ?? 0);
      this.setButton(Boolean(pad.buttons[0]?.pressed));
    } else if (!this.device || now - (this.heard ?? -Infinity) > kSilence_ms) return [0, 0, 0];
    const [right, towards, down] = beyond(this.push);
    return [right, -down, towards];
  }
}
