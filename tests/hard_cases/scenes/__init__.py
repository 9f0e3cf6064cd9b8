"""Every hard case, in one list. One idea a file; a file's cases are its `SCENES`."""

from harness.scene import HardScene

from scenes import garments, materials, meshes, numbers, obstacles, poses, stacks, trackers, twists

SCENES: tuple[HardScene, ...] = (
    *stacks.SCENES,
    *twists.SCENES,
    *obstacles.SCENES,
    *materials.SCENES,
    *meshes.SCENES,
    *numbers.SCENES,
    *poses.SCENES,
    *garments.SCENES,
    *trackers.SCENES,
)


def named(name: str) -> HardScene:
    """The case of that name. Raises KeyError."""
    return {scene.name: scene for scene in SCENES}[name]
