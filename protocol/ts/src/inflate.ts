import { ProtocolError } from "./errors.ts";

/** Decompresses one zstd frame of `size` bytes inside; it is handed in, so that this package carries no WebAssembly. */
export type Inflate = (data: Uint8Array, size: number) => Uint8Array;

/** Decompress, and insist on the size before anything is allocated for it. Throws ProtocolError "malformed_compression". */
export function inflateExactly(inflate: Inflate, data: Uint8Array, size: number, place: string): Uint8Array {
  const stated = statedSize(data);
  if (stated !== size) {
    throw wrongCompression(place, `The zstd frame states ${stated ?? "no"} bytes inside, ${size} were expected.`);
  }
  let bytes: Uint8Array;
  try {
    bytes = inflate(data, size);
  } catch (cause) {
    throw wrongCompression(place, `This isn't a zstd frame (${String(cause)}).`);
  }
  if (bytes.length !== size) {
    throw wrongCompression(place, `The zstd frame holds ${bytes.length} bytes, ${size} were expected.`);
  }
  return bytes;
}

function wrongCompression(place: string, message: string): ProtocolError {
  return new ProtocolError(
    "malformed_compression",
    place,
    message,
    "Send one zstd frame that states its content size in its header.",
  );
}

/** Content size in the header of a zstd frame (RFC 8878, section 3.1.1.1); null when there is none. */
function statedSize(data: Uint8Array): number | null {
  const magic = [0x28, 0xb5, 0x2f, 0xfd];
  if (data.length < 6 || magic.some((byte, index) => data[index] !== byte)) return null;
  const descriptor = data[4];
  const singleSegment = (descriptor & 0x20) !== 0;
  const sizeFlag = descriptor >> 6;
  const sizeBytes = sizeFlag === 0 ? Number(singleSegment) : 1 << sizeFlag;
  const start = 5 + Number(!singleSegment) + [0, 1, 2, 4][descriptor & 3];
  if (sizeBytes === 0 || data.length < start + sizeBytes) return null;
  let size = sizeFlag === 1 ? 256 : 0;
  for (let byte = 0; byte < sizeBytes; byte++) size += data[start + byte] * 256 ** byte;
  return size;
}
