// SPDX-License-Identifier: Apache-2.0
/** Where the page's data comes from: an element of the page, or the socket beside its address. */
import {DamagedData} from './container.js';

/** Bytes of base 64 text. */
function bytesOf(text) {
  let letters;
  try {
    letters = atob(text.trim());
  } catch {
    throw new DamagedData('The data inside this page is no base 64: the file was changed on its way.');
  }
  const bytes = new Uint8Array(letters.length);
  for (let i = 0; i < letters.length; ++i) bytes[i] = letters.charCodeAt(i);
  return bytes;
}

/**
 * The container inside the page, or nothing where the page is a live one.
 * @returns {Promise<ArrayBuffer | undefined>}
 */
export async function embeddedData() {
  const element = document.getElementById('palpate-data');
  if (!element) return undefined;
  const encoding = element.dataset.encoding;
  if (encoding !== 'gzip+base64' && encoding !== 'base64')
    throw new DamagedData(`The data inside this page is coded as "${encoding}", not "gzip+base64".`);
  const bytes = bytesOf(element.textContent);
  element.remove(); // a text of many megabytes, read once
  if (encoding === 'base64') return bytes.buffer;
  try {
    const plain = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('gzip'));
    return await new Response(plain).arrayBuffer();
  } catch {
    throw new DamagedData('The data inside this page is no whole gzip: the file is cut off or changed.');
  }
}

/** The socket's address beside the page's own. */
export function socketAddress() {
  const address = new URL('socket', location.href.split(/[?#]/)[0]);
  address.protocol = address.protocol === 'https:' ? 'wss:' : 'ws:';
  return address.href;
}

const kFirstWait = 500; // ms until the first new try
const kLongestWait = 8000; // ms

/** The connection to a running loop; it connects again after a loss. */
export class Connection {
  /**
   * @param {string} address
   * @param {{data: (buffer: ArrayBuffer) => void, text: (message: any) => void,
   *          state: (words: string, isOpen: boolean) => void}} listener
   */
  constructor(address, listener) {
    this.address = address;
    this.listener = listener;
    this.wait = kFirstWait;
    this.open();
  }

  open() {
    this.listener.state('connecting', false);
    this.socket = new WebSocket(this.address);
    this.socket.binaryType = 'arraybuffer';
    this.socket.onopen = () => {
      this.wait = kFirstWait;
      this.listener.state('connected', true);
    };
    this.socket.onmessage = event => {
      if (typeof event.data !== 'string') return this.listener.data(event.data);
      let message = {say: event.data, kind: 'error'};
      try {
        message = JSON.parse(event.data);
      } catch { /* shown as it came */ }
      this.listener.text(message);
    };
    this.socket.onclose = event => {
      const seconds = this.wait / 1000;
      const why = event.reason ? `the command says: ${event.reason}` : 'the command has ended, or cannot be reached';
      this.listener.state(`no connection: ${why}. ${this.listener.goesOn?.() ?? ''}Next try in ${seconds} s`, false);
      setTimeout(() => this.open(), this.wait);
      this.wait = Math.min(2 * this.wait, kLongestWait);
    };
  }

  /** Sends a command; one that cannot be sent now is dropped, as an old place of a hand has no use. */
  send(command) {
    if (this.socket.readyState !== WebSocket.OPEN) return false;
    this.socket.send(JSON.stringify(command));
    return true;
  }
}
