// SPDX-License-Identifier: Apache-2.0
// Reads what a playback page has inside, without the page's own code.
import {readFileSync} from 'node:fs';
import {gunzipSync} from 'node:zlib';

/** The description in the container of a page file (docs/view_protocol.md, 3). */
export function sceneOf(file) {
  const [, coded] = /id="palpate-data" data-encoding="gzip\+base64">([^<]*)</.exec(readFileSync(file, 'utf8'));
  const bytes = gunzipSync(Buffer.from(coded, 'base64'));
  return JSON.parse(bytes.subarray(16, 16 + bytes.readUInt32LE(12)).toString());
}
