import * as THREE from "three";

/**
 * The light of a photographer's studio as an environment map: a pale room, a large soft box above to the left, a
 * narrow one behind to the right. Made once; its scene is released.
 */
export function studioEnvironment(renderer: THREE.WebGLRenderer): THREE.Texture {
  const room = new THREE.Scene();
  const parts: THREE.Mesh[] = [
    glowing(new THREE.SphereGeometry(10, 24, 12), "#8f8b86", 1, THREE.BackSide),
    glowing(new THREE.PlaneGeometry(7, 7), "#fffaf2", 5),
    glowing(new THREE.PlaneGeometry(2.5, 7), "#eef3ff", 4),
    glowing(new THREE.CircleGeometry(9, 24), "#a79c8e", 1),
  ];
  const [, softBox, rimLight, ground] = parts as [THREE.Mesh, THREE.Mesh, THREE.Mesh, THREE.Mesh];
  softBox.position.set(-4, 6.5, 4);
  rimLight.position.set(6, 3, -5);
  softBox.lookAt(0, 1, 0);
  rimLight.lookAt(0, 1, 0);
  ground.position.y = -3;
  ground.rotation.x = -Math.PI / 2;
  room.add(...parts);

  const generator = new THREE.PMREMGenerator(renderer);
  const texture = generator.fromScene(room, 0.03).texture;
  generator.dispose();
  for (const part of parts) {
    part.geometry.dispose();
    (part.material as THREE.Material).dispose();
  }
  return texture;
}

function glowing(geometry: THREE.BufferGeometry, color: string, brightness: number, side: THREE.Side = THREE.DoubleSide): THREE.Mesh {
  const material = new THREE.MeshBasicMaterial({ color: new THREE.Color(color).multiplyScalar(brightness), side });
  return new THREE.Mesh(geometry, material);
}
