// SPDX-License-Identifier: BSD-3-Clause
// Decodes the columns that process_visualizer/page/packed.py has encoded.

/**
 * Position, type and encoding of a column.
 * @typedef {{at: number, of: string, n: number, as?: 'times'|'scaled', begin?: number,
 *   low?: number[], size?: number[]}} Reference
 */

/** @typedef {Float32Array|Float64Array|Int8Array|Uint8Array|Int16Array|Uint16Array|
 *   Int32Array|Uint32Array} Numbers */

const TYPES = {
  f4: Float32Array, f8: Float64Array, i1: Int8Array, u1: Uint8Array, i2: Int16Array,
  u2: Uint16Array, i4: Int32Array, u4: Uint32Array,
};

/**
 * Decodes base64 of gzip into bytes.
 * @param {string} text
 * @returns {Promise<ArrayBuffer>}
 */
export async function unpacked(text) {
  const letters = atob(text.trim());
  const bytes = new Uint8Array(letters.length);
  for (let i = 0; i < letters.length; ++i) bytes[i] = letters.charCodeAt(i);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('gzip'));
  return new Response(stream).arrayBuffer();
}

/** The columns of a page. */
export class Columns {
  /** @param {ArrayBuffer} buffer */
  constructor(buffer) {
    this.buffer = buffer;
  }

  /**
   * Returns the numbers of a column; times are in s.
   * @param {Reference} reference
   * @returns {Numbers}
   */
  of(reference) {
    const plain = new TYPES[reference.of](this.buffer, reference.at, reference.n);
    if (reference.as === 'times') return times(plain, reference.begin ?? 0);
    if (reference.as === 'scaled') return scaled(plain, reference.low ?? [], reference.size ?? []);
    return plain;
  }
}

/** @param {Numbers} steps  @param {number} begin */
function times(steps, begin) {
  const found = new Float64Array(steps.length);
  let ns = begin;
  for (let row = 0; row < steps.length; ++row) {
    ns += steps[row];
    found[row] = ns / 1e9;
  }
  return found;
}

/** @param {Numbers} shares  @param {number[]} low  @param {number[]} size */
function scaled(shares, low, size) {
  const width = low.length;
  const steps = 2 ** (8 * shares.BYTES_PER_ELEMENT) - 1;
  const found = new Float32Array(shares.length);
  for (let i = 0; i < shares.length; ++i) {
    found[i] = low[i % width] + shares[i] / steps * size[i % width];
  }
  return found;
}
