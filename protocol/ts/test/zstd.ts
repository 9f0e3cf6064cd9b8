import { ZSTDDecoder } from "zstddec";

import type { Inflate } from "../src/index.ts";

/** zstd for the tests: WebAssembly, as a browser would use it. */
export async function loadInflate(): Promise<Inflate> {
  const decoder = new ZSTDDecoder();
  await decoder.init();
  return (data, size) => decoder.decode(data, size);
}
