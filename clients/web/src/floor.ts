import * as THREE from "three";

/** radius of the lit disc around the wearer [m] */
const REACH = 5.5;

/** Fine lines half a metre apart: they give scale, and show the way made. They fade where they would crowd. */
const LINES = /* glsl */ `
  uniform vec2 centre;
  varying vec2 place;
  float lines(vec2 at, float spacing) {
    vec2 cell = at / spacing;
    vec2 width = fwidth(cell);
    vec2 away = abs(fract(cell - 0.5) - 0.5) / max(width, vec2(1e-6));
    float fade = 1.0 - smoothstep(0.25, 0.6, max(width.x, width.y));
    return (1.0 - min(min(away.x, away.y), 1.0)) * fade;
  }
`;

/** Floor, lines and shadow in one pass: a pale disc that fades into the background. */
const COLOUR = /* glsl */ `
  float shade = opacity * (1.0 - getShadowMask());
  float disc = 1.0 - smoothstep(0.0, 1.0, length(place - centre) / ${REACH.toFixed(1)});
  float line = 0.16 * lines(place, 0.5);
  vec3 ground = mix(mix(vec3(0.925, 0.9, 0.865), vec3(0.25, 0.23, 0.21), line), color, shade);
  gl_FragColor = vec4(ground, mix(0.6 * disc, 1.0, shade * min(1.0, 3.0 * disc)));
`;

/** The studio floor: it takes shadows and goes along with the wearer, while its lines stay where they are in the world. */
export class Floor {
  readonly object: THREE.Mesh;
  private readonly centre = new THREE.Vector2();

  constructor() {
    const material = new THREE.ShadowMaterial({ color: "#4d443b", opacity: 0.5, depthWrite: false, toneMapped: false });
    material.onBeforeCompile = (shader) => {
      shader.uniforms.centre = { value: this.centre };
      shader.vertexShader = shader.vertexShader
        .replace("void main() {", "varying vec2 place;\nvoid main() {")
        .replace("#include <worldpos_vertex>", "#include <worldpos_vertex>\nplace = worldPosition.xz;");
      shader.fragmentShader = shader.fragmentShader
        .replace("void main() {", `${LINES}\nvoid main() {`)
        .replace(/gl_FragColor = [^;]*;/, COLOUR);
    };
    this.object = new THREE.Mesh(new THREE.CircleGeometry(REACH, 64), material);
    this.object.rotation.x = -Math.PI / 2;
    this.object.receiveShadow = true;
    this.object.renderOrder = -1;
  }

  moveTo(x: number, z: number): void {
    this.object.position.set(x, 0, z);
    this.centre.set(x, z);
  }
}
