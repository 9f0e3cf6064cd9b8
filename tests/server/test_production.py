"""The solver behind the server's interface: a garment is dressed once and worn again."""

import os
from dataclasses import replace

import numpy as np
import patterns
import pytest
import trimesh
from analytic_drape import small_body

from tryon_server.problems import ProblemError
from tryon_server.runtime import production
from tryon_server.runtime.bodies import load_body
from tryon_server.runtime.motions import list_motions, load_motion
from tryon_server.runtime.order import DrapeOrder
from tryon_server.runtime.wardrobe import CAPACITY, Wardrobe, wardrobe_key

POSITIONS = np.arange(12, dtype=np.float32).reshape(4, 3)


@pytest.fixture
def order(tmp_path):
    capsule = trimesh.creation.capsule(height=0.6, radius=0.14, count=[16, 16])
    capsule.apply_transform(trimesh.transformations.rotation_matrix(-np.pi / 2, [1, 0, 0]))
    capsule.apply_translation([0, 0.75, 0])
    capsule.export(tmp_path / "capsule.ply")
    (tmp_path / "tube.json").write_bytes(patterns.as_bytes(patterns.tube(60.0, 40.0)))
    return DrapeOrder(
        pattern=tmp_path / "tube.json",
        fabric="cotton_jersey",
        preset="auto",
        device="cpu",
        edge_length=0.06,
        body=tmp_path / "capsule.ply",
        wardrobe=tmp_path / "dressed",
    )


def test_garment_is_dressed_once_and_worn_again_as_it_hung(order, monkeypatch):
    told = []
    first = production.build_drape(order, lambda stage, _: told.append(stage))
    assert "Sewing the seams" in told
    hung = first.cloth_positions()
    facts = first.advance(first.pose, 1 / 60)
    assert facts.to_dict()["times_ms"]
    assert not np.array_equal(first.cloth_positions(), hung), "it is simulated"

    monkeypatch.setattr(production, "dress", lambda *_, **__: pytest.fail("it was dressed again"))
    again = production.build_drape(order, lambda *_: None)
    np.testing.assert_array_equal(again.cloth_positions(), hung)
    again.advance(again.pose, 1 / 60)
    np.testing.assert_allclose(again.cloth_positions(), hung, atol=0.01)
    assert again.outfit.vertex_count == len(hung)
    assert again.outfit.panel_names == ("front", "back")


def test_key_of_the_wardrobe_changes_with_everything_that_has_a_say():
    body = small_body()
    keys = {
        wardrobe_key(b"pattern", body, ("cotton", 0.02)),
        wardrobe_key(b"another", body, ("cotton", 0.02)),
        wardrobe_key(b"pattern", body, ("denim", 0.02)),
        wardrobe_key(b"pattern", body, ("cotton", 0.03)),
        wardrobe_key(b"pattern", replace(body, rest_vertices=body.rest_vertices * 1.01), ("cotton", 0.02)),
    }
    assert len(keys) == 5
    assert wardrobe_key(b"pattern", small_body(), ("cotton", 0.02)) in keys


def test_wardrobe_gives_back_only_what_is_sound(tmp_path):
    wardrobe = Wardrobe(tmp_path / "dressed")
    assert wardrobe.recall("key", 4) is None
    wardrobe.keep("key", POSITIONS)
    np.testing.assert_array_equal(wardrobe.recall("key", 4), POSITIONS)
    assert wardrobe.recall("key", 5) is None
    wardrobe.keep("nan", POSITIONS * np.nan)
    assert wardrobe.recall("nan", 4) is None
    (tmp_path / "dressed" / "cut.npy").write_bytes(b"\x93NUMPY\x01")
    assert wardrobe.recall("cut", 4) is None


def test_wardrobe_makes_room_by_giving_up_the_longest_unused(tmp_path):
    wardrobe = Wardrobe(tmp_path)
    for k in range(CAPACITY + 1):
        wardrobe.keep(f"k{k}", POSITIONS)
        os.utime(tmp_path / f"k{k}.npy", (1000 + k, 1000 + k))
    wardrobe.recall("k1", 4)
    wardrobe.keep("last", POSITIONS)
    assert wardrobe.recall("k1", 4) is not None
    assert wardrobe.recall("k2", 4) is None


def test_mesh_file_becomes_a_body_that_stands_still(order):
    body = load_body(order.body)
    assert body.joint_names == ("body",)
    with pytest.raises(ProblemError, match=r"retargeting needs the rig"):
        load_motion("walk", body)


def test_folder_with_a_body_is_a_body(tmp_path):
    small_body().save(tmp_path / "body.npz")
    assert load_body(tmp_path).joint_names == small_body().joint_names
    assert load_body(tmp_path / "body.npz").joint_count == 3


def test_demo_motions_are_listed_with_their_length_the_walk_first():
    motions = list_motions()
    assert motions[0].name == "walk"
    assert {"squat", "jumping_jack"} < {motion.name for motion in motions}
    assert all(0.5 < motion.seconds < 60.0 for motion in motions)
