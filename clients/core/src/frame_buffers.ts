/**
 * Buffers that travel to the page with a frame each and come back when it has been drawn, so that a steady stream
 * allocates no vertex array. As many exist as are on their way at the same time.
 */
export class FrameBuffers {
  private free: ArrayBuffer[] = [];
  private byteLength = 0;

  /** Buffers have this size from now on; those of another size that come back are left to the collector. */
  resize(byteLength: number): void {
    this.byteLength = byteLength;
    this.free = [];
  }

  take(): ArrayBuffer {
    return this.free.pop() ?? new ArrayBuffer(this.byteLength);
  }

  giveBack(buffer: ArrayBuffer): void {
    if (buffer.byteLength === this.byteLength) this.free.push(buffer);
  }
}
