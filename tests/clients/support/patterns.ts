/** Made-up patterns, as a server tells them. */
import type { DesignEdge, DesignMessage, DesignPanel } from "@tryon/protocol";

/** A rectangle with its lower left corner at the origin; edge 0 is its hem, numbers go counter-clockwise. */
export function rectangle(name: string, width: number, height: number): DesignPanel {
  const vertices = [[0, 0], [width, 0], [width, height], [0, height]] as const;
  const edges = vertices.map(([x, y], i): DesignEdge => {
    const next = (i + 1) % 4;
    const [u, v] = vertices[next];
    const handles = [[x + (u - x) / 3, y + (v - y) / 3], [x + (2 * (u - x)) / 3, y + (2 * (v - y)) / 3]] as const;
    return { ends: [i, next], shape: "line", handles, points: [[x, y], [u, v]] };
  });
  return { name, label: "body", vertices, edges };
}

/** Front and back, sewn at their sides. */
export function design(changes: Partial<DesignMessage> = {}): DesignMessage {
  return {
    type: "design",
    held: false,
    panels: [rectangle("front", 0.5, 0.75), rectangle("back", 0.5, 0.75)],
    seams: [
      { first: [0, 1], second: [1, 3] },
      { first: [0, 3], second: [1, 1] },
    ],
    done: [],
    undone: 0,
    notes: [],
    ...changes,
  };
}
