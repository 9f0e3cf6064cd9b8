"""What follows from triangles alone: sums of small matrices against dense ones, pairs in rows, and who keeps it."""

from dataclasses import replace

import numpy as np
import pytest
from small_scenes import sheet

from tryon_solver.geometry.connectivity import Connectivity
from tryon_solver.geometry.element_sum import ElementSum, stable_order
from tryon_solver.geometry.garment import Garment, GarmentError
from tryon_solver.linalg.device_matrix import ElementMatrix


def total(summed, entries):
    """As the device adds them up."""
    made = ElementMatrix.build(summed.pattern, summed.order, summed.starts, "cpu")
    made.total.values.fill_(np.nan)
    made.entries.assign(entries.ravel())
    made.add_up()
    return made.total.matrix()


@pytest.mark.parametrize("k", [3, 4])
def test_the_sum_is_the_dense_one_and_the_same_bits_each_time(k):
    rng = np.random.default_rng(k)
    ids = np.array([rng.permutation(17)[:k] for _ in range(60)])
    entries = rng.normal(size=(60, k, k))
    dense = np.zeros((17, 17))
    for own, matrix in zip(ids, entries):
        dense[np.ix_(own, own)] += matrix
    summed = ElementSum.over(ids, 17)
    found = total(summed, entries)
    np.testing.assert_allclose(found.toarray(), dense, atol=1e-14)
    assert found.has_canonical_format
    assert np.array_equal(total(ElementSum.over(ids, 17), entries).data, found.data)
    np.testing.assert_array_equal(summed.pattern.toarray() != 0, dense != 0)
    assert total(summed, np.zeros_like(entries)).nnz == found.nnz, "an entry that is zero keeps its place"


def test_equal_numbers_keep_their_order():
    numbers = np.random.default_rng(1).integers(0, 9, 200)
    np.testing.assert_array_equal(stable_order(numbers, 9), np.argsort(numbers, kind="stable"))


def test_the_first_triangle_that_has_a_vertex_or_an_edge_owns_it():
    faces = sheet(5, 4, 0.2, 0.1)[0].faces + 1  # vertex 0 is in none
    made = Connectivity(faces, int(faces.max()) + 1)
    seen = set()
    for face, owned in zip(faces.tolist(), made.owned.tolist()):
        parts = [(vertex,) for vertex in face] + [tuple(sorted((face[k], face[(k + 1) % 3]))) for k in range(3)]
        assert [bool(owned >> k & 1) for k in range(6)] == [part not in seen for part in parts]
        seen.update(parts)
    assert sorted(part for part in seen if len(part) == 2) == [tuple(edge) for edge in made.edges.tolist()]


def test_pairs_are_those_that_share_a_triangle():
    garment = sheet(5, 4, 0.2, 0.1)[0]
    columns, slots = garment.connectivity.pairs
    shared = np.zeros((garment.vertex_count, garment.vertex_count), bool)
    for face in garment.faces:
        shared[np.ix_(face, face)] = True
    for vertex, row in enumerate(columns):
        assert row[0] == vertex
        others = row[1:][row[1:] != vertex]
        np.testing.assert_array_equal(others, np.setdiff1d(np.flatnonzero(shared[vertex]), vertex))
        assert (row[1 + len(others) :] == vertex).all()
    for face, slot in zip(garment.faces, slots.reshape(-1, 3, 3)):
        np.testing.assert_array_equal(columns[face[:, None], slot], np.tile(face, (3, 1)))


def test_a_hinge_knows_its_corners():
    garment = sheet(4, 4, 0.1, 0.1)[0]
    hinges, corners = garment.hinges(), garment.connectivity.hinge_corners
    for side in range(2):
        for k, column in enumerate((0, 1, 2 + side)):
            np.testing.assert_array_equal(garment.faces.ravel()[corners[side, k]], hinges[:, column])
            np.testing.assert_array_equal(corners[side, k] // 3, hinges[:, 4 + side])


def test_another_shape_keeps_it_and_other_triangles_do_not():
    garment = sheet(4, 4, 0.1, 0.1)[0]
    wider = replace(garment, uv_corners=1.1 * garment.uv_corners)
    assert wider.connectivity is garment.connectivity
    assert not np.array_equal(wider.corner_gradients(), garment.corner_gradients())
    turned = replace(garment, faces=garment.faces[::-1], uv_corners=garment.uv_corners[::-1])
    assert turned.connectivity is not garment.connectivity
    np.testing.assert_array_equal(turned.connectivity.faces, turned.faces)
    fewer = replace(garment, faces=garment.faces.copy())
    assert fewer.connectivity.faces is fewer.faces


def test_nobody_writes_to_what_is_kept():
    garment = sheet(3, 3, 0.1, 0.1)[0]
    for kept in (garment.signed_areas(), garment.corner_gradients()):
        with pytest.raises(ValueError, match="read-only"):
            kept[0] = 1.0


def test_an_edge_in_three_triangles_is_named():
    faces = np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]])
    uv = np.tile([[0.0, 0.0], [0.1, 0.0], [0.0, 0.1]], (3, 1, 1))
    with pytest.raises(GarmentError, match="edge 0-1 is in more than two triangles"):
        Garment(faces, uv, np.zeros(3, np.int32), 5).hinges()


def test_the_largest_vertex_counts():
    """Vertices whose numbers are no neighbours, as after a weld, and the last one of all."""
    summed = Connectivity(np.array([[0, 5, 9], [9, 5, 7]]), 10).triangle_sum
    found = total(summed, np.ones((2, 3, 3))).toarray()
    assert found[9, 5] == 2
    assert found[7, 9] == 1
    assert found[1].sum() == 0
