"""Values of effects that a case sets for itself."""

import pytest
from worn_pattern import effects_with

from tryon_solver.scene import WORN, AirDrag, Friction


def test_values_are_set_and_the_rest_stays() -> None:
    effects = effects_with({"Friction.presliding": 1e-3, "AirDrag.coefficient": 0.5, "d_hat": 1e-3})
    assert Friction(1e-3) in effects
    assert AirDrag(0.5) in effects
    assert [type(effect) for effect in effects] == [type(effect) for effect in WORN]
    assert set(effects) & set(WORN) == set(WORN) - {Friction(), AirDrag()}
    assert effects_with({}) == WORN


def test_an_effect_that_is_not_worn_is_an_error() -> None:
    with pytest.raises(ValueError, match="there is no effect Wind; the effects are Gravity"):
        effects_with({"Wind.speed": 1.0})
    with pytest.raises(TypeError, match="speed"):
        effects_with({"Friction.speed": 1.0})
