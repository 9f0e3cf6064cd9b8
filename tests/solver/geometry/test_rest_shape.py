"""Texture coordinates as a garment's pattern: what fits in none is found and told, what is worn stretched is left."""

import re

import numpy as np
import pytest

from tryon_solver.files.convention import Convention
from tryon_solver.files.mesh_garment import make_garment
from tryon_solver.files.raw_mesh import MeshFileError, RawMesh
from tryon_solver.subspace.basis import spline_basis

METRES = Convention("m", "y", "in a test")
AROUND, ALONG = 48, 24
RADIUS, HEIGHT = 0.2, 0.4


def tube(split=True):
    """A tube's vertices, its triangles, and its pattern's corners (F, 3, 2): unrolled, its seam split or not."""
    k = np.arange(AROUND + 1)
    rows = np.arange(ALONG + 1)
    angle = 2 * np.pi * k / AROUND
    height = HEIGHT * rows[:, None] / ALONG
    x = np.stack(np.broadcast_arrays(RADIUS * np.cos(angle), height, RADIUS * np.sin(angle)), -1)
    side = 2 * RADIUS * np.sin(np.pi / AROUND)
    uv = np.stack(np.broadcast_arrays(k * side, height), -1)
    i, j = (grid.ravel() for grid in np.meshgrid(rows[:-1], k[:-1], indexing="ij"))
    a = i * (AROUND + 1) + j
    b, c, d = a + 1, a + AROUND + 2, a + AROUND + 1
    corners = np.concatenate([np.stack([a, d, b], 1), np.stack([b, d, c], 1)])
    row, column = np.divmod(corners, AROUND + 1)
    column %= AROUND
    uv = uv.reshape(-1, 2)
    faces = row * AROUND + column
    of_corners = uv[corners if split else row * (AROUND + 1) + column]
    return x[:, :-1].reshape(-1, 3), faces, of_corners * [-1.0, 1.0]


def made(x, faces, uv, convention=METRES, rest_shape=None):
    count = len(faces)
    raw = RawMesh(
        name="tube.obj",
        vertices=x,
        faces=faces,
        uv=uv,
        lines=np.empty((0, 2), np.int64),
        part_of_face=np.zeros(count, int),
        part_names=("tube",),
        origin_of_face=1 + np.arange(count),
        origin_word="triangle",
    )
    return make_garment(raw, convention, rest_shape)


def told(garment):
    return [note for note in garment.notes if note.startswith("rest shape")]


def lengths(corners):
    return np.linalg.norm(corners[:, [1, 2, 0]] - corners, axis=2)


def carries(garment):
    """Whether the subspace carries every vertex."""
    basis = spline_basis(garment.garment, 4 * garment.garment.mean_edge_length())
    np.testing.assert_allclose(np.asarray(basis.sum(axis=1)).ravel(), 1.0, atol=1e-12)


def test_a_seam_that_is_not_split_in_the_texture_rests_as_it_lies_and_is_named():
    x, faces, whole = tube()
    _, _, wrapped = tube(split=False)
    column = np.flatnonzero((whole != wrapped).any(axis=(1, 2)))
    garment = made(x, faces, wrapped)
    first, second = told(garment)
    assert first == "rest shape: the pattern in its texture coordinates, in metres; 1 pieces"
    assert second.startswith(f"rest shape: {2 * ALONG} of its {len(faces)} triangles are up to 40 times as long")
    assert f"(tube.obj, triangles {column[0] + 1}, " in second
    assert "rest as they lie" in second
    assert "split the texture" in second
    np.testing.assert_allclose(lengths(garment.garment.uv_corners), lengths(x[faces]), rtol=1e-3)
    assert garment.piece_names == ("tube 1", "tube 2")
    np.testing.assert_array_equal(np.flatnonzero(garment.garment.panel_of_face == 1), column)
    carries(garment)


@pytest.mark.parametrize("stray", ["far", "on its neighbour"])
def test_a_stray_coordinate_costs_the_triangles_around_it_their_pattern_and_no_others(stray):
    x, faces, uv = tube()
    vertex = 10 * AROUND + 20
    uv[faces == vertex] = [50.0, 50.0] if stray == "far" else uv[faces == vertex + 1][0]
    around = (faces == vertex).any(axis=1)
    lost = around if stray == "far" else around & (faces == vertex + 1).any(axis=1)
    garment = made(x, faces, uv)
    assert garment.garment.signed_areas().sum() == pytest.approx(2 * np.pi * RADIUS * HEIGHT, rel=0.01)
    note = told(garment)[1]
    assert note.startswith(f"rest shape: {lost.sum()} of its {len(faces)} triangles are")
    assert (" almost without width in its texture" in note) == (stray != "far")
    assert f"(tube.obj, triangles {', '.join(str(k + 1) for k in np.flatnonzero(lost))})" in note
    kept = garment.garment.uv_corners[~around]
    np.testing.assert_allclose(kept, uv[~around])
    carries(garment)


def test_a_triangle_that_a_stray_coordinate_presses_flat_is_none_of_the_patterns():
    """No side is four times as long, and none as short; but it would be a sliver at rest."""
    x, faces, uv = tube()
    vertex = 10 * AROUND + 20
    across = 0.5 * (uv[faces == vertex + 1][0] + uv[faces == vertex + AROUND][0])
    uv[faces == vertex] = 0.9 * across + 0.1 * uv[faces == vertex][0]
    garment = made(x, faces, uv)
    flat = np.flatnonzero(garment.garment.panel_of_face == 1)
    assert len(flat) == 1
    np.testing.assert_allclose(lengths(garment.garment.uv_corners[flat]), lengths(x[faces[flat]]), rtol=1e-3)
    (note,) = told(garment)[1:]
    assert "1 of its 2304 triangles are almost without width" in note
    assert f"(tube.obj, triangle {flat[0] + 1})" in note


def test_what_rests_as_it_lies_is_as_much_smaller_as_the_rest():
    x, faces, uv = tube()
    uv *= 0.85
    uv[faces == 300] = [50.0, 50.0]
    garment = made(x, faces, uv)
    np.testing.assert_allclose(lengths(garment.garment.uv_corners), 0.85 * lengths(x[faces]), rtol=1e-3)


def test_many_strays_make_no_pattern_and_are_named_too():
    x, faces, uv = tube()
    high = x[faces][:, :, 1].max(axis=1) > 0.9 * HEIGHT
    uv[high] *= 30.0
    garment = made(x, faces, uv)
    first, second = told(garment)
    assert "are no pattern" in first
    assert f"{high.sum()} of its {len(faces)} triangles are up to" in second
    assert f"tube.obj, triangles {np.flatnonzero(high)[0] + 1}, " in second
    assert garment.garment.signed_areas().sum() == pytest.approx(2 * np.pi * RADIUS * HEIGHT, rel=0.01)


def test_gathers_stay_in_the_pattern_and_are_told():
    """Cloth that is three times as wide where it is sewn on as it lies there."""
    x, faces, uv = tube()
    row = 5.5 * HEIGHT / ALONG
    here = np.flatnonzero(np.abs(x[faces][:, :, 1].mean(axis=1) - row) < 0.4 * HEIGHT / ALONG)[:20]
    uv[here] *= [3.0, 1.0]
    garment = made(x, faces, uv)
    np.testing.assert_allclose(garment.garment.uv_corners, uv)
    (note,) = told(garment)[1:]
    assert "20 of its triangles are" in note
    assert "times as long in its pattern as they lie" in note
    assert f"(tube.obj, triangles {here[0] + 1}, " in note


@pytest.mark.parametrize("scale", [0.8, 0.9, 1.0, 1.02, 1.1, 1.25])
def test_a_pattern_of_another_size_than_it_is_worn_in_is_told(scale):
    x, faces, uv = tube()
    garment = made(x, faces, scale * (1 - 1e-9 * (scale > 1)) * uv)
    (note,) = told(garment)
    assert "the pattern in its texture coordinates, in metres" in note
    found = re.search(r"its lengths are (\d\.\d\d) times those of the shape it comes in", note)
    if abs(scale - 1) < 0.03:
        assert found is None
    else:
        assert found is not None
        assert float(found[1]) == pytest.approx(scale, abs=0.006)


def in_unit_square(uv):
    """The same charts as a packer leaves them: from 0 to 1, whatever their size."""
    uv = uv - uv.min(axis=(0, 1))
    return uv / uv.max()


def test_a_texture_that_fills_the_unit_square_is_no_pattern_for_being_as_large_as_one():
    """A tube of 1.16 m around, its texture from 0 to 1: 0.86 times its lengths."""
    x, faces, uv = tube()
    x = x * 1.16 / np.ptp(uv[..., 0])
    (note,) = told(made(x, faces, in_unit_square(uv)))
    assert "rest shape: the shape it comes in, as its texture coordinates fill the unit square and have 0.86 " in note
    assert note.endswith("--rest-shape pattern if they are one")
    garment = made(x, faces, in_unit_square(uv), rest_shape="pattern")
    np.testing.assert_allclose(lengths(garment.garment.uv_corners), lengths(x[faces]) / 1.16, rtol=1e-2)


def test_a_pattern_in_metres_is_one_also_where_it_happens_to_fill_the_unit_square():
    x, faces, uv = tube()
    size = 1.0 / np.ptp(uv[..., 0])
    for worn in (1.0, 1.06):  # the cloth is 6 % longer there than in its pattern
        (note,) = told(made(worn * size * x, faces, in_unit_square(uv)))
        assert "the pattern in its texture coordinates, in metres" in note
        assert ("0.94 times" in note) == (worn > 1)


@pytest.mark.parametrize(("stretch", "taken"), [(1.05, True), (1.25, False), (1.4, False)])
def test_a_texture_stretched_over_its_square_is_no_pattern(stretch, taken):
    x, faces, uv = tube()
    uv = in_unit_square(uv) * [1 / stretch, stretch]
    x = x / np.ptp(uv[..., 0])
    scale = np.median(lengths(x[faces]) / np.linalg.norm(uv[:, [1, 2, 0]] - uv, axis=2))
    (note,) = told(made(x / scale, faces, uv))
    assert ("the pattern in its" in note) == taken
    if not taken:
        assert f"lengthen it {stretch**2:.2f} times more one way than the other" in note


def test_charts_in_sizes_of_their_own_are_a_textures():
    """The lower third is drawn half as large again as the rest."""
    x, faces, uv = tube()
    low = x[faces][:, :, 1].max(axis=1) < HEIGHT / 3 + 1e-9
    uv = uv - uv.min(axis=(0, 1))
    uv[low] *= 1.5
    uv[~low] += [0.0, 0.2]
    (note,) = told(made(x, faces, 0.5 * uv + [2.0, 1.0]))
    assert "are no pattern" in note, "half the size"
    (note,) = told(made(0.5 * x, faces, 0.5 * uv))
    assert "lengthen some of it 1.50 times more than the rest" in note
    assert note.startswith("rest shape: the shape it comes in")


def test_a_pattern_worn_stretched_around_is_taken_and_told():
    """A tight knit that is 1.2 times as wide worn as drawn, in coordinates that no texture has."""
    x, faces, uv = tube()
    (note,) = told(made(x, faces, uv * [1 / 1.2, 1.0]))
    assert "the pattern in its texture coordinates, in metres" in note
    assert "its coordinates lengthen it 1.20 times more one way than the other, --rest-shape shape if" in note
    (note,) = told(made(x, faces, uv * [1.3, 0.8]))
    assert note.startswith("rest shape: the shape it comes in")
    assert "1.63 times more one way" in note


def test_strays_are_found_in_the_files_own_unit():
    x, faces, uv = tube()
    uv[faces == 300] = [50.0, 50.0]
    garment = made(100 * x, faces, 100 * uv, Convention("cm", "y", "in a test"))
    first, second = told(garment)
    assert first.endswith("in cm; 1 pieces")
    assert "6 of its" in second
    np.testing.assert_allclose(lengths(garment.garment.uv_corners), lengths(x[faces]), rtol=1e-3)


def test_what_a_garment_rests_in_may_be_told():
    x, faces, uv = tube()
    (note,) = told(made(x, faces, 0.8 * uv))
    assert note.endswith("those of the shape it comes in, --rest-shape shape if it is no pattern")
    garment = made(x, faces, 0.8 * uv, rest_shape="shape")
    assert told(garment) == ["rest shape: the shape it comes in, as told"]
    np.testing.assert_allclose(lengths(garment.garment.uv_corners), lengths(x[faces]))
    (note,) = told(made(x, faces, 0.7 * uv))
    assert note.endswith("are no pattern; --rest-shape pattern if they are one")
    garment = made(x, faces, 0.7 * uv, rest_shape="pattern")
    (note,) = told(garment)
    assert note.startswith("rest shape: the pattern in its texture coordinates, in metres, as told; 1 pieces; ")
    np.testing.assert_allclose(garment.garment.uv_corners, 0.7 * uv)


def test_what_is_told_to_be_a_pattern_and_is_none_is_refused():
    x, faces, uv = tube()
    high = x[faces][:, :, 1].max(axis=1) > 0.9 * HEIGHT
    strayed = np.where(high[:, None, None], 30.0 * uv, uv)
    for wrong in (None, 5.0 * uv, 0.0 * uv, strayed):
        with pytest.raises(MeshFileError, match="told to be its pattern, but") as caught:
            made(x, faces, wrong, rest_shape="pattern")
        assert "--rest-shape" in caught.value.remedy
    assert caught.value.place.startswith(f"tube.obj, triangles {np.flatnonzero(high)[0] + 1}, ")
    with pytest.raises(MeshFileError, match="'crumpled' is no rest shape") as caught:
        made(x, faces, uv, rest_shape="crumpled")
    assert "pattern, shape" in caught.value.remedy
