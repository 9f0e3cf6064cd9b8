"""The size in which a garment is worn: sizes are tried in a known order until one fits, and what was found is told."""

from dataclasses import dataclass
from pathlib import Path

import pytest

from tryon_solver.body.model import default_body
from tryon_solver.dressing.dress import dress
from tryon_solver.dressing.fit import CrowdedError, CrumpledError, DressingError, TightError
from tryon_solver.dressing.opening import Opening
from tryon_solver.dressing.to_fit import LARGER, MOST_TRIES, NoSizeError, dress_to_fit, search
from tryon_solver.geometry.pattern import load_pattern
from tryon_solver.geometry.placement import PlacementError
from tryon_solver.geometry.size import mesh_in_size
from tryon_solver.materials.fabric import FABRICS
from tryon_solver.settings import PRESETS

SKIRT = Path(__file__).resolve().parents[3] / "server" / "tryon_server" / "demo" / "patterns" / "skirt.json"


@dataclass
class Waist:
    """As an Opening: of a garment cut in a size that only the waist knows, to be told in which; `right` would fit."""

    cut: float
    right: float
    size: float = 1.0
    too_small: float = 0.0
    tight_below: bool = False  # in the size that fits the waist

    @property
    def fitting_size(self):
        return self.size * self.right / self.cut

    @property
    def advice(self):
        return f"size {self.fitting_size:.2f} fits the waist" if self.cut > 1.03 * self.right else ""


@dataclass
class Hung:
    """As a Dressed."""

    size: float
    right: float

    def upper_opening(self):
        return Waist(self.size, self.right) if self.right else None


class Shop:
    """Garments too tight below one size, whose waist (if they hang by it) is right in another."""

    def __init__(self, smallest, waist=0.0):
        self.smallest, self.waist, self.tried = smallest, waist, []

    def put_on(self, size):
        self.tried.append(size)
        if size < self.smallest:
            raise TightError("too tight", "panels.front", "larger")
        return Hung(size, self.waist)

    def fit(self, drawn=None):
        return search(self.put_on, drawn)


def test_what_fits_in_its_own_size_is_worn_in_it():
    shop = Shop(0.9, waist=1.0)
    fitted = shop.fit()
    assert (fitted.size, shop.tried, fitted.describe()) == (1.0, [1.0], "size 1")


def test_what_shoulders_hold_is_never_too_wide():
    assert Shop(0.5).fit().size == 1.0


def test_a_wide_waist_is_worn_in_the_size_that_fits_it():
    fitted = Shop(0.9, waist=0.92).fit()
    assert (fitted.size, fitted.dressed.size) == (0.92, 0.92)
    assert fitted.describe() == "size 0.92; in size 1, size 0.92 fits the waist"


def test_sizes_are_told_over_the_patterns_own():
    """0.85 is worn by what the drawing says, and still wide: the size said to fit is no share of that one."""
    fitted = Shop(0.5, waist=0.8).fit(Waist(1.0, 0.85))
    as_drawn = "in size 1, as drawn, size 0.85 fits the waist"
    assert fitted.describe() == f"size 0.8; {as_drawn}; in size 0.85, size 0.80 fits the waist"


def test_a_waist_drawn_too_wide_is_not_worn_first():
    shop = Shop(0.9, waist=0.92)
    fitted = shop.fit(Waist(1.0, 0.92))
    assert (fitted.size, shop.tried) == (0.92, [0.92])
    assert fitted.describe() == "size 0.92; in size 1, as drawn, size 0.92 fits the waist"


def test_a_size_that_is_too_tight_below_by_the_drawing_is_not_tried():
    """The waist asks for 0.92, in which the hips are known to be too wide."""
    shop = Shop(0.9, waist=0.0)
    fitted = shop.fit(Waist(1.0, 0.92, tight_below=True))
    assert (fitted.size, shop.tried) == (1.0, [1.0])


def test_a_size_that_is_too_tight_below_where_it_hangs_is_not_tried(monkeypatch):
    monkeypatch.setattr(Hung, "upper_opening", lambda hung: Waist(hung.size, hung.right, tight_below=True))
    shop = Shop(0.9, waist=0.92)
    assert (shop.fit().size, shop.tried) == (1.0, [1.0])


def test_what_is_too_tight_is_worn_larger():
    fitted = Shop(1.15, waist=1.3).fit()
    assert fitted.size == pytest.approx(LARGER**2)
    assert fitted.describe().count("too tight") == 2


def test_what_is_wide_above_and_tight_below_is_worn_as_small_as_it_can_be_put_on():
    """The waist asks for 0.92, but below 0.95 nothing goes on: the pattern's own size is kept and worn."""
    shop = Shop(0.95, waist=0.92)
    fitted = shop.fit()
    assert (fitted.size, fitted.dressed.size, shop.tried) == (1.0, 1.0, [1.0, 0.92])
    assert "in size 0.92, too tight" in fitted.describe()


def test_a_size_known_to_be_too_tight_is_not_tried_again():
    shop = Shop(1.05, waist=0.92)
    assert shop.fit(Waist(1.0, 0.92)).size == 1.1
    assert shop.tried == [0.92, 1.0, 1.1], "the pattern's own size among them"


def test_what_is_too_tight_in_every_size_is_refused_with_all_that_were_tried():
    shop = Shop(5.0)
    with pytest.raises(NoSizeError) as caught:
        shop.fit()
    assert shop.tried == [1.0, 1.1, 1.21, 1.33, 1.46]
    assert len(shop.tried) == MOST_TRIES
    assert caught.value.message.startswith("it goes on in none of the sizes 1, 1.1, 1.21, 1.33, 1.46: in size 1, too t")
    assert caught.value.place == "panels.front"
    assert "larger than 1.46" in caught.value.remedy


@pytest.mark.parametrize("kind", [CrumpledError, CrowdedError])
@pytest.mark.parametrize(("goes_on", "tried"), [(1.1, [1.0, 1.1]), (0.91, [1.0, 1.1, 0.91])])
def test_what_is_crumpled_is_worn_larger_or_smaller(kind, goes_on, tried):
    sizes = []

    def put_on(size):
        sizes.append(size)
        if size != goes_on:
            raise kind("crumpled", "garment", "smoother")
        return Hung(size, 0.0)

    fitted = search(put_on, None)
    assert (fitted.size, fitted.dressed.size, sizes) == (goes_on, goes_on, tried)
    assert fitted.describe().startswith(f"size {goes_on:g}; in size 1, crumpled")


def test_what_crumples_in_its_own_size_and_is_tight_below_ends_in_a_size_that_was_tried():
    """As a godet skirt does: its waist asks for 0.92, its hem for more."""
    sizes = []

    def put_on(size):
        sizes.append(size)
        if size < 1.0:
            raise TightError("too tight", "panels.hem", "larger")
        if size == 1.0:
            raise CrumpledError("crumpled", "garment", "smoother")
        return Hung(size, 0.92)

    fitted = search(put_on, Waist(1.0, 0.92))
    assert (fitted.size, fitted.dressed.size, sizes) == (1.1, 1.1, [0.92, 1.0, 1.1])
    assert fitted.upper_opening().too_small == 1.0, "so that no smaller size is advised"
    assert "in size 0.92, too tight; in size 1, crumpled" in fitted.describe()


def test_a_waist_that_lies_below_the_body_says_no_size_to_begin_with():
    shop = Shop(0.5)
    below = Opening(("band",), -0.2, 0.8, 0.0, None, -0.5)
    assert (shop.fit(below).size, shop.tried) == (1.0, [1.0])


def test_a_waist_that_no_size_fits_is_worn_in_the_smallest_there_is():
    shop = Shop(0.3, waist=0.2)
    assert (shop.fit(Waist(1.0, 0.2)).size, shop.tried) == (0.5, [0.5])


@pytest.mark.parametrize("kind", [DressingError, PlacementError])
def test_what_is_misplaced_in_a_smaller_size_may_go_on_in_its_own(kind):
    sizes = []

    def put_on(size):
        sizes.append(size)
        if size < 1.0:
            raise kind("the body is between its sides", "panels.front", "move it")
        return Hung(size, 0.92)

    assert (search(put_on, Waist(1.0, 0.92)).size, sizes) == (1.0, [0.92, 1.0])


def test_what_is_wrong_in_any_size_is_refused_at_once():
    tried = []

    def put_on(size):
        tried.append(size)
        raise DressingError("the body is between its sides", "garment", "move it")

    with pytest.raises(DressingError, match=r"^garment: the body is between its sides"):
        search(put_on, None)
    assert tried == [1.0]


@pytest.mark.long
def test_a_skirt_cut_too_wide_is_worn_in_the_size_that_holds():
    """The demo's skirt, cut a quarter wider and longer than it is drawn."""
    skirt, body, sizes = load_pattern(SKIRT), default_body(), []

    def cut(size):
        return mesh_in_size(skirt, 0.05, 1.25 * size)

    def put_on(size):
        sizes.append(size)
        return dress(cut(size), body, FABRICS["cotton_jersey"], PRESETS["draft"], settle_seconds=0.3)

    fitted = dress_to_fit(put_on, cut(1.0), body)
    assert 0.7 < fitted.size < 0.9
    assert sizes[-1] == fitted.size
    assert 1.0 not in sizes, "it is measured in its own size, not worn"
    assert "too wide" in fitted.describe()
    assert fitted.dressed.upper_opening().advice == ""
