import type { Point } from "./pattern_design.ts";
import type { Grip } from "./pattern_shape.ts";

/** The edits that the page makes, as they travel (PROTOCOL.md section 3.2); lengths in metres. */
export type PatternEdit =
  | { readonly kind: "move_vertex"; readonly panel: string; readonly vertex: number; readonly by: Point }
  | { readonly kind: "move_handle"; readonly panel: string; readonly edge: number; readonly handle: number; readonly by: Point }
  | { readonly kind: "lengthen" | "take_in"; readonly panel: string; readonly edge: number; readonly by: number }
  | { readonly kind: "open_seam"; readonly panel: string; readonly edge: number }
  | { readonly kind: "scale_piece"; readonly panel: string; readonly factors: Point };

/** The edit that moves a grip. */
export function moveGrip(panel: string, grip: Grip, by: Point): PatternEdit {
  if (grip.kind === "vertex") return { kind: "move_vertex", panel, vertex: grip.vertex, by };
  return { kind: "move_handle", panel, edge: grip.edge, handle: grip.handle, by };
}
