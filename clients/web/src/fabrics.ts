import type { Fabric } from "@tryon/core";
import * as THREE from "three";

import type { FabricLook } from "./materials.ts";

/**
 * How fabrics look close by. Thread distances are those of the common cloth of that name, drawn somewhat coarser so that
 * the weave can be made out on a screen. A fabric that is not listed gets a plain weave that suits its weight.
 */
const LOOKS: readonly (readonly [name: RegExp, look: FabricLook])[] = [
  [/denim|twill|canvas|drill/i, { weave: "twill", pitch: 0.0017, relief: 0.75, roughness: 0.92, sheen: 0.25 }],
  [/jersey|knit|rib|fleece/i, { weave: "knit", pitch: 0.0018, relief: 0.4, roughness: 0.95, sheen: 0.45 }],
  [/wool|felt|tweed/i, { weave: "twill", pitch: 0.0024, relief: 0.7, roughness: 1, sheen: 0.8 }],
  [/silk|satin|charmeuse/i, { weave: "plain", pitch: 0.0009, relief: 0.12, roughness: 0.42, sheen: 0.9 }],
  [/leather/i, { weave: "plain", pitch: 0.003, relief: 0.1, roughness: 0.5, sheen: 0 }],
  [/linen/i, { weave: "plain", pitch: 0.0021, relief: 0.8, roughness: 0.95, sheen: 0.2 }],
];

export function lookOf(fabric: Fabric): FabricLook {
  const known = LOOKS.find(([name]) => name.test(fabric.name));
  if (known) return known[1];
  const heavy = fabric.areal_density > 0.25;
  return { weave: "plain", pitch: heavy ? 0.002 : 0.0014, relief: heavy ? 0.7 : 0.45, roughness: 0.9, sheen: 0.35 };
}

/** The fabric's own colour as a CSS colour. */
export function colourOf(fabric: Fabric): string {
  return `#${new THREE.Color(...fabric.colour).getHexString(THREE.SRGBColorSpace)}`;
}

/** Colours to dye any fabric with, beside its own. */
export const DYES: readonly (readonly [name: string, colour: string])[] = [
  ["Chalk", "#ece7dd"],
  ["Sand", "#c8b08b"],
  ["Brick", "#a6523c"],
  ["Rose", "#c98b8b"],
  ["Olive", "#6d7048"],
  ["Pine", "#2f5a4c"],
  ["Sky", "#86a7c2"],
  ["Ink", "#2c3a55"],
  ["Plum", "#5d3a54"],
  ["Charcoal", "#34322f"],
];

/** A picture of the weave for a swatch, as a CSS background: no texture file is needed. */
export function swatchTexture(look: FabricLook): string {
  const light = `rgb(255 255 255 / ${0.06 + 0.1 * look.relief})`;
  const dark = `rgb(0 0 0 / ${0.05 + 0.1 * look.relief})`;
  const shine = `radial-gradient(circle at 32% 28%, rgb(255 255 255 / ${0.55 * (1 - look.roughness) + 0.1}), transparent 60%)`;
  if (look.weave === "twill") return `repeating-linear-gradient(45deg, ${light} 0 1.5px, ${dark} 1.5px 3px), ${shine}`;
  if (look.weave === "knit") return `repeating-linear-gradient(90deg, ${dark} 0 1px, transparent 1px 4px), repeating-linear-gradient(0deg, ${light} 0 1px, transparent 1px 3px), ${shine}`;
  return `repeating-linear-gradient(0deg, ${dark} 0 1px, transparent 1px 2.5px), repeating-linear-gradient(90deg, ${light} 0 1px, transparent 1px 2.5px), ${shine}`;
}
