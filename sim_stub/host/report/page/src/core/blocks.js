// SPDX-License-Identifier: Apache-2.0
// Tables of numbers as they stand in the page (DATA.md, "Block"): base64, maybe deflated, column after column.

const TYPES = { f32: Float32Array, i16: Int16Array, i32: Int32Array, u8: Uint8Array };
const MISSING = { i16: -32768, i32: -2147483648 };

function bytesOf(base64) {
  const text = atob(base64);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  return bytes;
}

async function inflated(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** The block's bytes, fetched once: what unpack() reads. Inflating is the browser's, and it does not wait for us. */
export async function load(block) {
  const bytes = bytesOf(block.data);
  block.bytes = block.zlib ? await inflated(bytes) : bytes;
  block.data = null;
}

const of = (numbers, column, otherwise) => (Array.isArray(numbers) ? numbers[column] : (numbers ?? otherwise));

/** One Float64Array a column; what is missing is NaN. */
export function unpack(block) {
  const Type = TYPES[block.type];
  if (!Type) throw new Error(`a block has the unknown type "${block.type}"`);
  const wanted = block.count * block.columns * Type.BYTES_PER_ELEMENT;
  if (block.bytes.length !== wanted) throw new Error(`a block has ${block.bytes.length} bytes and not ${wanted}`);
  const raw = new Type(block.bytes.slice().buffer);
  const missing = MISSING[block.type];
  const columns = [];
  for (let c = 0; c < block.columns; ++c) {
    const part = raw.subarray(c * block.count, (c + 1) * block.count);
    if (block.delta) for (let i = 1; i < part.length; ++i) part[i] += part[i - 1]; // wraps as it was written
    const scale = of(block.scale, c, 1),
      offset = of(block.offset, c, 0);
    columns.push(Float64Array.from(part, (v) => (v === missing ? NaN : offset + scale * v)));
  }
  return columns;
}
