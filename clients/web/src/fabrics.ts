import type { Colour, Fabric } from "@tryon/core";
import * as THREE from "three";

/** A linear colour as a CSS colour. */
export function cssColour(colour: Colour): string {
  return `#${new THREE.Color(...colour).getHexString(THREE.SRGBColorSpace)}`;
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

/** px of a swatch for a metre of cloth: it is shown three times as large as on a screen of 96 px to the inch */
const SWATCH_SCALE = (3 * 96) / 0.0254;

/** What a swatch shows of a fabric: its own weave, as CSS backgrounds. */
export function swatchStyle(fabric: Fabric): Readonly<Record<"--dye" | "--texture" | "--texture-size", string>> {
  const [width, height] = fabric.look.tile.map((side) => `${(side * SWATCH_SCALE).toFixed(1)}px`);
  return {
    "--dye": cssColour(fabric.look.colour),
    "--texture": `url("${new URL(fabric.look.colour_map.replace(/^\//, ""), document.baseURI).href}")`,
    "--texture-size": `${width} ${height}`,
  };
}
