"""The fabric as a part of the pattern."""

import pytest

from tryon_solver.geometry.pattern import PatternError, parse_pattern
from tryon_solver.redesign.apply import apply
from tryon_solver.redesign.both_sides import apply_to_both
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.edits import ChangeFabric
from tryon_solver.redesign.fabrics import made_of, named_fabric
from tryon_solver.redesign.structure import difference


def test_a_pattern_names_what_it_is_made_of(tshirt):
    assert named_fabric(tshirt) is parse_pattern(tshirt).fabric is None
    made = apply(tshirt, ChangeFabric("denim"))
    assert named_fabric(made.specification) == parse_pattern(made.specification).fabric == "denim"
    assert made.specification == made_of(tshirt, "denim"), "nothing else is changed"
    assert (made.change, made.notes) == ("topology", ())


def test_another_fabric_needs_another_mesh_to_be_worn(tshirt):
    before, after = parse_pattern(made_of(tshirt, "silk")), parse_pattern(made_of(tshirt, "denim"))
    assert difference(before, after).message == "it is of denim instead of silk"
    assert difference(before, before) is None


def test_what_it_is_of_already_is_refused(tshirt):
    with pytest.raises(EditError, match="it is of 'denim' already") as caught:
        apply(made_of(tshirt, "denim"), ChangeFabric("denim"))
    assert caught.value.place == "fabric"


def test_it_is_of_both_sides(tshirt):
    made = apply_to_both(tshirt, ChangeFabric("denim"))
    assert made.specification == made_of(tshirt, "denim")
    assert made.notes == ("done once: it is of the whole garment",)


@pytest.mark.parametrize("name", ["", 3, ["denim"], "x" * 300, True])
def test_what_is_no_name_is_refused(tshirt, name):
    with pytest.raises(PatternError, match="not the name of a fabric") as caught:
        parse_pattern(made_of(tshirt, name))
    assert caught.value.place == "properties.fabric"
