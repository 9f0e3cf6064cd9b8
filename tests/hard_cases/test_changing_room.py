"""A garment that was dressed for one case hangs in the next one as if it had been dressed for it."""

from dataclasses import replace

import numpy as np
import pytest
from harness import wearer
from harness.changing_room import hung
from harness.scene import Ask

ASK = Ask(150)


def test_what_hangs_there_is_taken_for_what_is_asked_for_alike_and_for_nothing_else(tmp_path):
    made = []

    def dress():
        made.append(np.float32([[len(made), 0, 0]]))
        return made[-1], 2 * made[-1]

    for folder, what, which in (
        (tmp_path, ("tshirt", 150), 0),
        (tmp_path, ("tshirt", 150), 0),
        (tmp_path, ("tshirt", 200), 1),
        (tmp_path, ("tshirt", 150), 0),
        (None, ("tshirt", 150), 2),
        (None, ("tshirt", 150), 3),
    ):
        cloth, surface = hung(folder, what, dress)
        np.testing.assert_array_equal(cloth, made[which])
        np.testing.assert_array_equal(surface, 2 * made[which])
    assert len(made) == 4


@pytest.mark.long
def test_the_second_case_puts_on_what_the_first_has_dressed(tmp_path, monkeypatch):
    alone = wearer.put_on(ASK, "tshirt")
    together = replace(ASK, dressed=tmp_path / "dressed")
    first = wearer.put_on(together, "tshirt")

    def refuse(*_arguments):
        raise AssertionError("dressed again")

    monkeypatch.setattr(wearer, "dress", refuse)
    second = wearer.put_on(together, "tshirt")
    for sim in (first, second):
        np.testing.assert_array_equal(sim.cloth_positions(), alone.cloth_positions())
        np.testing.assert_array_equal(sim.body_positions(), alone.body_positions())
    for other in ({"fabric": "denim"}, {"across": 1.1}, {"down": 1.1}):
        with pytest.raises(AssertionError, match="dressed again"):
            wearer.put_on(together, "tshirt", **other)
    for ask in (replace(together, vertices=200), replace(together, device="cuda:0"), ASK):
        with pytest.raises(AssertionError, match="dressed again"):
            wearer.put_on(ask, "tshirt")
