import type { DesignPanel } from "@tryon/protocol";

import type { Point } from "./pattern_design.ts";
import { outwards, type Grip } from "./pattern_shape.ts";

/** The edits that the page makes, as they travel (PROTOCOL.md section 3.2); lengths in metres. */
export type PatternEdit =
  | { readonly kind: "move_vertex"; readonly panel: string; readonly vertex: number; readonly by: Point }
  | { readonly kind: "move_handle"; readonly panel: string; readonly edge: number; readonly handle: number; readonly by: Point }
  | { readonly kind: "lengthen" | "take_in"; readonly panel: string; readonly edge: number; readonly by: number }
  | { readonly kind: "open_seam"; readonly panel: string; readonly edge: number }
  | { readonly kind: "gather"; readonly panel: string; readonly edge: number; readonly to?: number }
  | { readonly kind: "ease"; readonly panel: string; readonly edge: number; readonly by?: number }
  | { readonly kind: "close_seam"; readonly panel: string; readonly edge: number; readonly to_panel: string; readonly to_edge: number }
  | { readonly kind: "cut"; readonly panel: string; readonly line: readonly [Point, Point]; readonly sewn: boolean }
  | { readonly kind: "dart"; readonly panel: string; readonly edge: number; readonly position: number; readonly width: number; readonly depth: number }
  | { readonly kind: "patch" | "pocket"; readonly panel: string; readonly at: Point; readonly width: number; readonly height: number }
  | { readonly kind: "scale_piece"; readonly panel: string; readonly factors: Point }
  | { readonly kind: "scale_garment"; readonly factors: Point }
  | { readonly kind: "scale_garment"; readonly made_for: Readonly<Record<string, number>>; readonly wanted: Readonly<Record<string, number>> }
  | { readonly kind: "remove_piece"; readonly panel: string }
  | { readonly kind: "change_fabric"; readonly fabric: string };

/** The edit that moves a grip of a piece; an edge goes as far across itself as it is moved that way. */
export function moveGrip(piece: DesignPanel, grip: Grip, by: Point): PatternEdit {
  const panel = piece.name;
  if (grip.kind === "vertex") return { kind: "move_vertex", panel, vertex: grip.vertex, by };
  if (grip.kind === "edge") return { kind: "lengthen", panel, edge: grip.edge, by: outwards(piece, grip.edge, by) };
  return { kind: "move_handle", panel, edge: grip.edge, handle: grip.handle, by };
}
