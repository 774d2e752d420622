// SPDX-License-Identifier: Apache-2.0
/**
 * The binary container of the page (docs/view_protocol.md): "PALPVIEW", version, JSON, blobs; little-endian.
 * @typedef {{json: any, blob: (name: string, count?: number, type?: string) => any}} Container
 */

/** Data that the page cannot show; the message is for the reader of the page. */
export class DamagedData extends Error {}

const kVersion = 1;
const kHead = 16; // bytes before the JSON
const kTypes = {
  u8: Uint8Array, i16: Int16Array, u16: Uint16Array, u32: Uint32Array, f32: Float32Array,
  f64: Float64Array,
};

function readHead(bytes) {
  if (bytes.byteLength < kHead)
    throw new DamagedData(`The data ends after ${bytes.byteLength} bytes, within its first ${kHead}.`);
  const magic = String.fromCharCode(...bytes.subarray(0, 8));
  if (magic !== 'PALPVIEW')
    throw new DamagedData('The data does not begin with PALPVIEW: it is of another kind.');
  const view = new DataView(bytes.buffer, bytes.byteOffset);
  const version = view.getUint32(8, true);
  if (version !== kVersion)
    throw new DamagedData(`The data has version ${version}, this page reads version ${kVersion}: ` +
                          'open it with the Palpate that wrote it.');
  return view.getUint32(12, true);
}

function readJson(bytes, length) {
  if (kHead + length > bytes.byteLength)
    throw new DamagedData(`The description needs ${length} bytes, and there are ` +
                          `${bytes.byteLength - kHead}: the data is cut off.`);
  try {
    const text = new TextDecoder('utf-8', {fatal: true}).decode(bytes.subarray(kHead, kHead + length));
    const json = JSON.parse(text);
    if (json && typeof json === 'object' && typeof json.kind === 'string') return json;
  } catch { /* said below */ }
  throw new DamagedData('The description of the data is no JSON object with a "kind".');
}

/**
 * Reads a container. What a blob's entry says is checked when the blob is asked for.
 * @param {ArrayBuffer} buffer
 * @returns {Container}
 */
export function readContainer(buffer) {
  const bytes = new Uint8Array(buffer);
  const length = readHead(bytes);
  const json = readJson(bytes, length);
  const base = Math.ceil((kHead + length) / 8) * 8;
  const blobs = json.blobs ?? {};

  function blob(name, count, type) {
    const entry = Object.hasOwn(blobs, name) ? blobs[name] : undefined;
    if (!entry) throw new DamagedData(`The data has no blob "${name}".`);
    const Type = Object.hasOwn(kTypes, entry.type) ? kTypes[entry.type] : undefined;
    if (!Type || (type && entry.type !== type))
      throw new DamagedData(`Blob "${name}" has type "${entry.type}"${type ? `, not "${type}"` : ''}.`);
    if (!Number.isSafeInteger(entry.offset) || entry.offset < 0 || entry.offset % 8 !== 0)
      throw new DamagedData(`Blob "${name}" has offset ${entry.offset}, which is no multiple of 8.`);
    if (!Number.isSafeInteger(entry.count) || entry.count < 0 ||
        (count !== undefined && entry.count !== count))
      throw new DamagedData(`Blob "${name}" has ${entry.count} values` +
                            (count === undefined ? '.' : `, and ${count} are needed.`));
    const begin = base + entry.offset;
    const end = begin + entry.count * Type.BYTES_PER_ELEMENT;
    if (end > buffer.byteLength)
      throw new DamagedData(`Blob "${name}" ends at byte ${end}, and the data has ` +
                            `${buffer.byteLength}: it is cut off.`);
    return new Type(buffer, begin, entry.count);
  }
  return {json, blob};
}
