"""Topologies there and back, and those that don't fit together."""

from __future__ import annotations

from dataclasses import fields, replace

import msgspec
import numpy as np
import pytest

from tryon_protocol import (
    BodySurface,
    GarmentTopology,
    ProtocolError,
    Topology,
    TopologyMessage,
    decode_server,
    encode,
)
from tryon_protocol.arrays import MAX_ARRAY_BYTES


def assert_equal(one: Topology, other: Topology) -> None:
    for owner, twin in ((one, other), (one.body, other.body)):
        for field in fields(owner):
            value, same = getattr(owner, field.name), getattr(twin, field.name)
            if isinstance(value, np.ndarray):
                assert value.dtype == same.dtype
                np.testing.assert_array_equal(value, same)
            elif not isinstance(value, BodySurface):
                assert value == same


@pytest.mark.parametrize("compress", [True, False])
@pytest.mark.parametrize("bare", [True, False])
def test_a_topology_comes_back_whole(topology: Topology, compress: bool, bare: bool) -> None:
    if bare:
        topology = replace(topology, uv=None, panel_of_face=None, panel_names=())
    message = decode_server(encode(topology.to_message(compress=compress)))
    assert isinstance(message, TopologyMessage)
    assert_equal(Topology.from_message(message), topology)


def test_wider_numbers_are_brought_to_the_wire_types(topology: Topology) -> None:
    body = topology.body
    wide = BodySurface(
        rest_vertices=body.rest_vertices.astype(np.float64),  # type: ignore[arg-type]
        faces=body.faces.astype(np.int64),  # type: ignore[arg-type]
        joint_names=body.joint_names,
        parents=body.parents.astype(np.int64),  # type: ignore[arg-type]
        rest_joints=body.rest_joints.astype(np.float64),  # type: ignore[arg-type]
        skin_joints=body.skin_joints.astype(np.int32),  # type: ignore[arg-type]
        skin_weights=body.skin_weights.astype(np.float64),  # type: ignore[arg-type]
    )
    assert_equal(replace(topology, body=wide), topology)


def spoiled(array: np.ndarray, index: tuple[int, ...], value: float) -> np.ndarray:
    changed = array.astype(np.float64 if isinstance(value, float) else np.int64)
    changed[index] = value
    return changed


@pytest.mark.parametrize(
    ("name", "change", "place"),
    [
        ("rest_vertices", lambda a: spoiled(a, (4, 1), np.nan), "body.rest_vertices[4][1]"),
        ("rest_vertices", lambda a: a[:, :2], "body.rest_vertices"),
        ("faces", lambda a: spoiled(a, (0, 0), 10_000), "body.faces"),
        ("faces", lambda a: spoiled(a, (0, 0), -1), "body.faces"),
        ("faces", lambda a: a.astype(np.float64), "body.faces"),
        ("parents", lambda a: spoiled(a, (1,), 3), "body.parents"),
        ("parents", lambda a: spoiled(a, (2,), -1), "body.parents"),
        ("parents", lambda a: spoiled(a, (0,), 0), "body.parents"),
        ("rest_joints", lambda a: a[:-1], "body.rest_joints"),
        ("skin_joints", lambda a: spoiled(a, (0, 0), 5), "body.skin_joints"),
        ("skin_weights", lambda a: spoiled(a, (6, 0), 3.0), "body.skin_weights[6]"),
        ("skin_weights", lambda a: a[:, :1], "body.skin_weights"),
        ("joint_names", lambda _: (), "body.joint_names"),
    ],
)
def test_a_body_that_does_not_fit_is_refused_by_the_name_of_its_array(topology, name, change, place) -> None:
    with pytest.raises(ProtocolError) as caught:
        replace(topology.body, **{name: change(getattr(topology.body, name))})
    assert (caught.value.code, caught.value.place) == ("invalid_array", place)
    assert caught.value.remedy


@pytest.mark.parametrize(
    ("changes", "place"),
    [
        ({"topology_id": 0}, "topology_id"),
        ({"cloth_vertex_count": 0}, "cloth.vertex_count"),
        ({"cloth_vertex_count": 7}, "cloth.faces"),
        ({"grid": 0.0}, "grid"),
        ({"grid": 0.01}, "grid"),
        ({"uv": np.zeros((2, 3, 2))}, "cloth.uv"),
        ({"panel_names": ("one",)}, "cloth.panel_of_face"),
    ],
)
def test_a_garment_that_does_not_fit_is_refused(topology, changes, place) -> None:
    with pytest.raises(ProtocolError) as caught:
        replace(topology, **changes)
    assert (caught.value.code, caught.value.place) == ("invalid_array", place)


def parts(*shares):
    """Garments with these shares of vertices, triangles and panels, one after the other."""
    starts = np.cumsum([(0, 0, 0), *shares], axis=0)[:-1].tolist()
    return tuple(
        GarmentTopology(name=f"g{k}", fabric="cotton", **dict(zip(("vertices", "faces", "panels"), zip(first, share))))
        for k, (first, share) in enumerate(zip(starts, shares))
    )


@pytest.mark.parametrize(
    ("shares", "place"),
    [
        ([(40, 60, 1), (19, 36, 1)], "cloth.garments"),
        ([(40, 60, 1), (20, 35, 1)], "cloth.garments"),
        ([(40, 60, 1), (20, 36, 2)], "cloth.garments"),
    ],
)
def test_garments_share_out_all_of_the_cloth(topology, shares, place) -> None:
    assert (topology.cloth_vertex_count, len(topology.faces)) == (60, 96)
    whole = replace(topology, garments=parts((40, 60, 1), (20, 36, 1)))
    assert Topology.from_message(whole.to_message()).garments == whole.garments
    with pytest.raises(ProtocolError) as caught:
        replace(topology, garments=parts(*shares))
    assert (caught.value.code, caught.value.place) == ("invalid_array", place)
    with pytest.raises(ProtocolError) as caught:
        replace(topology, garments=whole.garments[::-1])
    assert caught.value.place == "cloth.garments[0].vertices"


@pytest.mark.parametrize(
    ("changes", "place", "code"),
    [
        ({"dtype": "int32"}, "$.cloth.faces.dtype", "invalid_array"),
        ({"shape": (96, 2)}, "$.cloth.faces.shape", "invalid_array"),
        ({"shape": (288,)}, "$.cloth.faces.shape", "invalid_array"),
        ({"shape": (95, 3)}, "$.cloth.faces.data", "malformed_compression"),
        ({"shape": (MAX_ARRAY_BYTES, 3)}, "$.cloth.faces.shape", "invalid_array"),
        ({"data": b"nothing of zstd"}, "$.cloth.faces.data", "malformed_compression"),
        ({"codec": "none"}, "$.cloth.faces.data", "invalid_array"),
    ],
)
def test_an_array_that_lies_about_itself_is_refused(topology, changes, place, code) -> None:
    message = topology.to_message()
    faces = msgspec.structs.replace(message.cloth.faces, **changes)
    wrong = msgspec.structs.replace(message, cloth=msgspec.structs.replace(message.cloth, faces=faces))
    with pytest.raises(ProtocolError) as caught:
        Topology.from_message(wrong)
    assert (caught.value.code, caught.value.place) == (code, place)
