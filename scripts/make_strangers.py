"""Writes what strangers would bring: two garments as meshes and two moving bodies, each as some exporter leaves them.

    python scripts/make_strangers.py FOLDER

| file | what is awkward about it |
|---|---|
| `skirt.obj` | centimetres, Z up; two pieces with their pattern as texture coordinates, in metres; one side seam |
| | doubled, the other open with stitch lines; a round waist on a body that is not round: it starts inside the body |
| `top.glb` | every triangle has vertices of its own, as flat shading exports them; texture coordinates that are no |
| | pattern; it starts under the skin at the back |
| `walk/*.obj` | a folder of frames in centimetres, Z up: the body steps from its rest pose into a walk |
| `squat.glb` | a skin with four times the vertices, a hole where the mouth is, and its own bones turned any way |
"""

from __future__ import annotations

import argparse
import json
import struct
from pathlib import Path

import numpy as np

from tryon_solver.body import default_body, parse_bvh, quaternions, retarget
from tryon_solver.body.model import BodyModel
from tryon_solver.body.motion import Motion, blend_in
from tryon_solver.body.pose import Pose, skin, world_from_joint

DEMO = Path(__file__).resolve().parents[1] / "server" / "tryon_server" / "demo"

WAIST, HEM = 1.08, 0.62  # m, heights of the skirt's edges
WAIST_RADIUS, HEM_RADIUS = 0.126, 0.23  # m
MIDDLE = 0.035  # m, how far before the pelvis the trunk's middle is
OPENING = 0.006  # m, half of the open seam's width
COLUMNS, ROWS = 24, 26  # of each of the skirt's pieces


def z_up_centimetres(x: np.ndarray) -> np.ndarray:
    """From our metres, Y up."""
    return 100.0 * np.stack([x[..., 0], -x[..., 2], x[..., 1]], axis=-1)


# -- the skirt ---------------------------------------------------------------------------------------------------------


def skirt(finer: int = 1) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[tuple[str, np.ndarray]], np.ndarray]:
    """Vertices (V, 3) m, texture coordinates (V, 2) m, quads (Q, 4), (name, quads) by piece, stitches (S, 2).

    `finer` times as many columns and rows.
    """
    columns, rows = finer * COLUMNS, finer * ROWS
    slant = np.hypot(WAIST - HEM, HEM_RADIUS - WAIST_RADIUS)
    sine = (HEM_RADIUS - WAIST_RADIUS) / slant
    from_apex = WAIST_RADIUS / sine
    vertices, uv, pieces, quads = [], [], [], []
    for k, name in enumerate(("front", "back")):
        share = np.linspace(0.0, 1.0, rows + 1)
        radius = WAIST_RADIUS + share * (HEM_RADIUS - WAIST_RADIUS)
        height = WAIST + share * (HEM - WAIST)
        # the front from the left side (angle 0, the doubled seam) to the right (pi, the open one); the back from there
        angle = np.linspace(0.0, np.pi, columns + 1)[None] - np.outer(OPENING / radius, np.linspace(0, 1, columns + 1))
        turn = angle if k == 0 else -angle
        x = np.stack(
            [
                radius[:, None] * np.cos(turn),
                np.broadcast_to(height[:, None], turn.shape),
                MIDDLE + radius[:, None] * np.sin(turn),
            ],
            axis=-1,
        )
        along = from_apex + share * slant
        flat = angle * sine
        uv.append(np.stack([along[:, None] * np.sin(flat), -along[:, None] * np.cos(flat)], axis=-1).reshape(-1, 2))
        vertices.append(x.reshape(-1, 3))
        start = k * (rows + 1) * (columns + 1)
        i, j = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
        at = start + i * (columns + 1) + j
        cells = np.stack([at, at + 1, at + columns + 2, at + columns + 1], axis=-1).reshape(-1, 4)
        if k == 1:
            cells = cells[:, ::-1]
        quads.append(cells)
        pieces.append((name, cells))
    right = np.arange(rows + 1) * (columns + 1) + columns
    stitches = np.stack([right, right + (rows + 1) * (columns + 1)], axis=1)
    return np.vstack(vertices), np.vstack(uv), np.vstack(quads), pieces, stitches


def write_skirt(path: Path, finer: int = 1) -> None:
    x, uv, _, pieces, stitches = skirt(finer)
    lines = ["# Some DCC program 4.2", "mtllib skirt.mtl"]
    lines += ["v {:.6f} {:.6f} {:.6f}".format(*p) for p in z_up_centimetres(x)]
    lines += ["vt {:.6f} {:.6f}".format(*p) for p in uv]
    for name, cells in pieces:
        lines += [f"g {name}", "usemtl cotton"]
        lines += ["f " + " ".join(f"{v}/{v}" for v in cell) for cell in cells + 1]
    lines += ["g seams"] + ["l {} {}".format(*pair) for pair in stitches + 1]
    path.write_text("\n".join(lines) + "\n")


# -- the top -----------------------------------------------------------------------------------------------------------


def top(body: BodyModel) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (V, 3) m and faces (F, 3): the trunk's and upper arms' skin, moved outwards."""
    wanted = {
        k
        for k, name in enumerate(body.joint_names)
        if name.startswith("spine") or any(part in name for part in ("clavicle", "shoulder", "upper_arm"))
    }
    mostly = body.skin_joints[np.arange(body.vertex_count), body.skin_weights.argmax(axis=1)]
    x = body.rest_vertices
    inside = np.isin(mostly, sorted(wanted)) & (x[:, 1] > 0.97) & (x[:, 1] < 1.425)
    faces = body.faces[inside[body.faces].all(axis=1)]
    corners = x[body.faces]
    normals = np.zeros_like(x)
    for k in range(3):
        np.add.at(normals, body.faces[:, k], np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    sunk = np.exp(-((x - [0.0, 1.15, -0.06]) ** 2).sum(axis=1) / 0.08**2)
    moved = x + (0.012 - 0.018 * sunk)[:, None] * normals
    used, faces = np.unique(faces, return_inverse=True)
    return moved[used], faces.reshape(-1, 3)


def write_top(path: Path, body: BodyModel) -> None:
    x, faces = top(body)
    corners = x[faces].reshape(-1, 3)
    uv = np.column_stack([np.arctan2(corners[:, 0], corners[:, 2]) / (2 * np.pi) + 0.5, corners[:, 1] - 0.9])
    glb = Glb()
    mesh = glb.mesh("top", corners, np.arange(len(corners)).reshape(-1, 3), {"TEXCOORD_0": uv.astype(np.float32)})
    glb.nodes.append({"name": "top", "mesh": mesh})
    glb.write(path, [0])


# -- the bodies --------------------------------------------------------------------------------------------------------


def motion_from_rest(body: BodyModel, name: str, seconds: float) -> Motion:
    """The demo's motion, entered from the rest pose, `seconds` long, at 30 frames a second."""
    clip = retarget(parse_bvh((DEMO / "motions" / f"{name}.bvh").read_text()), body)
    rest = Pose.rest(body)
    clip = Motion(clip.roots + (rest.root - clip.roots[0]) * [1, 0, 1], clip.rotations, clip.dt, name)
    lead = blend_in(rest, clip, 1.0)
    poses = [
        lead.sample(t) if t < lead.duration else clip.sample(t - lead.duration, loop=True)
        for t in np.arange(round(30 * seconds)) / 30
    ]
    return Motion(np.array([p.root for p in poses]), np.array([p.rotations for p in poses]), 1 / 30, name)


def write_walk(folder: Path, body: BodyModel, seconds: float) -> None:
    motion = motion_from_rest(body, "walk", seconds)
    folder.mkdir(parents=True, exist_ok=True)
    faces = ["f {} {} {}".format(*face) for face in body.faces + 1]
    for k in range(motion.frame_count):
        x = z_up_centimetres(skin(body, motion.pose(k)))
        lines = ["o body", *("v {:.5f} {:.5f} {:.5f}".format(*p) for p in x), *faces]
        (folder / f"walk_{k + 1:04d}.obj").write_text("\n".join(lines) + "\n")


def subdivided(body: BodyModel) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rest vertices (V, 3) m, faces (F, 3) and dense skin weights (V, J), each triangle cut into four."""
    dense = np.zeros((body.vertex_count, body.joint_count))
    np.add.at(dense, (np.arange(body.vertex_count)[:, None], body.skin_joints), body.skin_weights)
    sides = body.faces[:, [[0, 1], [1, 2], [2, 0]]]
    edges, index = np.unique(np.sort(sides.reshape(-1, 2), axis=1), axis=0, return_inverse=True)
    middle = body.vertex_count + index.reshape(-1, 3)
    a, b, c = body.faces.T
    ab, bc, ca = middle.T
    quarters = [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
    faces = np.stack([np.stack(q, axis=1) for q in quarters], axis=1).reshape(-1, 3)
    vertices = np.vstack([body.rest_vertices, body.rest_vertices[edges].mean(axis=1)])
    return vertices, faces, np.vstack([dense, dense[edges].mean(axis=1)])


def write_squat(path: Path, body: BodyModel, seconds: float) -> None:
    motion = motion_from_rest(body, "squat", seconds)
    vertices, faces, dense = subdivided(body)
    mouth = np.linalg.norm(vertices[faces].mean(axis=1) - [0.0, 1.52, 0.14], axis=1) < 0.02
    faces = faces[~mouth]
    best = np.argsort(-dense, axis=1)[:, :4]
    weights = np.take_along_axis(dense, best, axis=1).astype(np.float32)
    weights /= weights.sum(axis=1, keepdims=True)
    glb = Glb()
    mesh = glb.mesh(
        "body", vertices, faces, {"JOINTS_0": best.astype(np.uint16), "WEIGHTS_0": weights.astype(np.float32)}
    )
    # bones rolled any way, as rigging programs do: joint k has the rest rotation rolls[k]
    rng = np.random.default_rng(3)
    rolls = quaternions.normalise(rng.normal(size=(body.joint_count, 4)))
    rest = world_from_joint(body, Pose.rest(body))
    rest[:, :3, :3] = quaternions.to_matrix(rolls)
    first = len(glb.nodes)
    for k, name in enumerate(body.joint_names):
        parent = body.parents[k]
        children = [first + int(c) for c in np.flatnonzero(body.parents == k)]
        local = rest[k] if parent < 0 else np.linalg.inv(rest[parent]) @ rest[k]
        roll = rolls[k] if parent < 0 else quaternions.multiply(quaternions.conjugate(rolls[parent]), rolls[k])
        node = {"name": name, "translation": local[:3, 3].tolist(), "rotation": roll.tolist()}
        glb.nodes.append({**node, "children": children} if children else node)
    skin_id = glb.skin([first + k for k in range(body.joint_count)], np.linalg.inv(rest))
    glb.nodes.append({"name": "body", "mesh": mesh, "skin": skin_id})
    times = glb.accessor(np.arange(motion.frame_count, dtype=np.float32) * np.float32(motion.dt), "SCALAR", True)
    for k in range(body.joint_count):
        parent = body.parents[k]
        # ours turns away from the unturned rest pose; theirs is relative to the rolled parent
        turned = quaternions.multiply(motion.rotations[:, k], rolls[k])
        if parent >= 0:
            turned = quaternions.multiply(quaternions.conjugate(rolls[parent]), turned)
        glb.animate(times, first + k, "rotation", turned.astype(np.float32))
    glb.animate(times, first, "translation", motion.roots.astype(np.float32))
    glb.write(path, [first, first + body.joint_count])


class Glb:
    """A .glb while it is put together."""

    def __init__(self) -> None:
        self.blob = bytearray()
        self.nodes: list[dict] = []
        self.parts: dict[str, list] = {name: [] for name in ("accessors", "bufferViews", "meshes", "skins")}
        self.channels: list[dict] = []
        self.samplers: list[dict] = []

    def accessor(self, values: np.ndarray, kind: str, bounds: bool = False) -> int:
        codes = {"float32": 5126, "uint16": 5123, "uint32": 5125}
        while len(self.blob) % 4:
            self.blob.append(0)
        self.parts["bufferViews"].append({"buffer": 0, "byteOffset": len(self.blob), "byteLength": values.nbytes})
        self.blob += np.ascontiguousarray(values).tobytes()
        accessor = {
            "bufferView": len(self.parts["bufferViews"]) - 1,
            "componentType": codes[values.dtype.name],
            "count": len(values),
            "type": kind,
        }
        if bounds:
            flat = values.reshape(len(values), -1)
            accessor |= {"min": flat.min(axis=0).tolist(), "max": flat.max(axis=0).tolist()}
        self.parts["accessors"].append(accessor)
        return len(self.parts["accessors"]) - 1

    def mesh(self, name: str, vertices: np.ndarray, faces: np.ndarray, more: dict[str, np.ndarray]) -> int:
        attributes = {"POSITION": self.accessor(vertices.astype(np.float32), "VEC3", True)}
        for key, values in more.items():
            attributes[key] = self.accessor(values, f"VEC{values.shape[1]}")
        indices = self.accessor(faces.astype(np.uint32).ravel(), "SCALAR")
        self.parts["meshes"].append({"name": name, "primitives": [{"attributes": attributes, "indices": indices}]})
        return len(self.parts["meshes"]) - 1

    def skin(self, joints: list[int], inverse_bind: np.ndarray) -> int:
        columns = inverse_bind.transpose(0, 2, 1).astype(np.float32).reshape(-1, 16)
        matrices = self.accessor(columns, "MAT4")
        self.parts["skins"].append({"joints": joints, "inverseBindMatrices": matrices})
        return len(self.parts["skins"]) - 1

    def animate(self, times: int, node: int, path: str, values: np.ndarray) -> None:
        output = self.accessor(values, f"VEC{values.shape[1]}")
        self.samplers.append({"input": times, "output": output, "interpolation": "LINEAR"})
        self.channels.append({"sampler": len(self.samplers) - 1, "target": {"node": node, "path": path}})

    def write(self, path: Path, roots: list[int]) -> None:
        while len(self.blob) % 4:
            self.blob.append(0)
        document = {
            "asset": {"version": "2.0", "generator": "Some DCC program 4.2"},
            "scene": 0,
            "scenes": [{"nodes": roots}],
            "nodes": self.nodes,
            "buffers": [{"byteLength": len(self.blob)}],
            **{name: values for name, values in self.parts.items() if values},
        }
        if self.channels:
            document["animations"] = [{"samplers": self.samplers, "channels": self.channels}]
        text = json.dumps(document).encode()
        text += b" " * (-len(text) % 4)
        with path.open("wb") as file:
            file.write(struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(self.blob)))
            file.write(struct.pack("<II", len(text), 0x4E4F534A) + text)
            file.write(struct.pack("<II", len(self.blob), 0x004E4942) + bytes(self.blob))


def write_all(folder: Path, seconds: float = 4.0, finer: int = 1) -> None:
    """Write all four into `folder`; motions are `seconds` long, the skirt `finer` times as fine."""
    body = default_body()
    folder.mkdir(parents=True, exist_ok=True)
    write_skirt(folder / "skirt.obj", finer)
    write_top(folder / "top.glb", body)
    write_walk(folder / "walk", body, seconds)
    write_squat(folder / "squat.glb", body, seconds)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seconds", type=float, default=4.0, help="length of the motions (default 4)")
    parser.add_argument("--finer", type=int, default=1, metavar="N", help="the skirt with N times the rows and columns")
    options = parser.parse_args()
    write_all(options.folder, options.seconds, options.finer)
    print(f"wrote {options.folder}")


if __name__ == "__main__":
    main()
