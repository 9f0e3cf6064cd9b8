import { ProtocolError } from "./errors.ts";

/** Decompresses one zstd frame of `size` bytes inside; it is handed in, so that this package carries no WebAssembly. */
export type Inflate = (data: Uint8Array, size: number) => Uint8Array;

/** Decompress, and insist on the size. Throws ProtocolError "malformed_compression". */
export function inflateExactly(inflate: Inflate, data: Uint8Array, size: number, place: string): Uint8Array {
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
