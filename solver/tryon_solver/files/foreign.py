"""Files of kinds that are known but not read: each is named by its content or its ending, with what to do instead."""

from __future__ import annotations

from pathlib import PurePath

LOOKED_AT = 512  # bytes that are enough to tell
BLENDS = {"FBX", "COLLADA", "USD", "Alembic", "Blender"}  # what Blender opens
BODIES = {"glTF", "NumPy archive", "zip archive"}  # what bodies come in

STARTS = (
    (b"Kaydara FBX", "FBX"),
    (b"; FBX", "FBX"),
    (b"BLENDER", "Blender"),
    (b"Ogawa", "Alembic"),
    (b"PXR-USDC", "USD"),
    (b"#usda", "USD"),
    (b"HIERARCHY", "BVH"),
    (b":ASF", "ASF"),
    (b"# ASF", "ASF"),
    (b"Vocaloid Motion Data", "VMD"),
    (b"glTF", "glTF"),
    (b"\x93NUMPY", "NumPy array"),
    (b"\x1f\x8b", "gzip-compressed"),
)
"""What files of a kind begin with."""
ENDINGS = {
    ".fbx": "FBX",
    ".dae": "COLLADA",
    ".usd": "USD",
    ".usda": "USD",
    ".usdc": "USD",
    ".usdz": "USD",
    ".abc": "Alembic",
    ".blend": "Blender",
    ".bvh": "BVH",
    ".asf": "ASF",
    ".amc": "AMC",
    ".c3d": "C3D",
    ".trc": "TRC",
    ".vmd": "VMD",
    ".glb": "glTF",
    ".gltf": "glTF",
    ".npy": "NumPy array",
    ".npz": "NumPy archive",
    ".pkl": "Python pickle",
}
BODY_REMEDIES = {
    "BVH": "A BVH file is a motion: give it as the motion, and leave the body out",
    "ASF": "It is a skeleton without a surface: convert it with its AMC file to BVH, and give that as the motion",
    "AMC": "It is a motion without a surface: convert it with its ASF file to BVH, and give that as the motion",
    "C3D": "It holds markers without a surface: solve it to a skeleton, and give that as BVH for the motion",
    "TRC": "It holds markers without a surface: solve it to a skeleton, and give that as BVH for the motion",
    "VMD": "It is a motion without a surface: convert it to BVH, and give that as the motion",
    "NumPy array": "Write an .npz of vertices (frames, V, 3), faces (F, 3) and fps with numpy.savez",
    "Python pickle": "Write an .npz of vertices (frames, V, 3), faces (F, 3) and fps with numpy.savez",
    "gzip-compressed": "Unpack it, and give the file that is in it",
}
BODY_REMEDY = "Export it as a .glb with its animation, as .obj frames, or as an .npz of vertices, faces and fps"
MOTION_REMEDIES = {
    "glTF": "Give a .glb that holds a body as the body, which then moves by itself; or convert its skeleton to BVH",
    "NumPy archive": "Give an .npz of vertices, faces and fps as the body, which then moves by itself; or convert the "
    "poses of SMPL, as AMASS has them, to BVH",
    "zip archive": "Unpack it, and give the BVH file that is in it",
    "gzip-compressed": "Unpack it, and give the BVH file that is in it",
    "Python pickle": "Convert the poses of SMPL that it may hold to BVH",
}
MOTION_REMEDY = "Convert it to BVH"


def kind_of_foreign(start: bytes, ending: str) -> str | None:
    """The kind of a file that begins with `start` or, where that does not tell, ends so (".fbx"); None: not known."""
    if start[:2] == b"PK":
        return "NumPy archive" if b".npy" in start else "zip archive"
    if b"<COLLADA" in start:
        return "COLLADA"
    bare = start.lstrip()
    return next((kind for words, kind in STARTS if bare.startswith(words)), None) or ENDINGS.get(ending.lower())


def no_body(start: bytes, name: str) -> tuple[str, str] | None:
    """What is wrong with a file as a body, and the remedy; None where it may be one. `start`: its first LOOKED_AT
    bytes."""
    kind = kind_of_foreign(start, PurePath(name).suffix)
    if kind is None or kind in BODIES:
        return None
    return _refusal(kind, BODY_REMEDIES.get(kind, BODY_REMEDY), "a .glb")


def no_motion(start: bytes, name: str) -> tuple[str, str] | None:
    """The same of a file as a motion."""
    kind = kind_of_foreign(start, PurePath(name).suffix)
    if kind in (None, "BVH"):
        return None
    return _refusal(kind, MOTION_REMEDIES.get(kind, MOTION_REMEDY), "BVH")


def _refusal(kind: str, remedy: str, wanted: str) -> tuple[str, str]:
    article = "an" if kind[:1] in "AF" else "a"
    opened = f"; Blender opens it and exports {wanted}" if kind in BLENDS else ""
    return f"it is {article} {kind} file, which is not read here", f"{remedy}{opened}"
