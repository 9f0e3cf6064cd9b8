/** Something on the wire breaks the rules of PROTOCOL.md: what, where, and what to change. */
export class ProtocolError extends Error {
  override readonly name = "ProtocolError";

  /**
   * @param code name of the fault, PROTOCOL.md section 6
   * @param place where it lies, such as "frame.cloth_bytes"
   * @param message what is wrong
   * @param remedy what to change
   */
  constructor(
    readonly code: string,
    readonly place: string,
    message: string,
    readonly remedy: string,
  ) {
    super(`${place}: ${message} ${remedy}`);
  }
}

/** Bytes that contradict PROTOCOL.md section 7. */
export function malformed(place: string, message: string): ProtocolError {
  return new ProtocolError(
    "malformed_frame",
    place,
    message,
    "The sender breaks the protocol, or the message was cut: reconnect.",
  );
}
