"""The T-shirt on some frames of each motion, judged frame by frame by IPC Toolkit and by figures of a worn garment."""

import numpy as np
import pytest
from worn_garment import run_window

FPS, DRAFT_FPS, FRAMES = 60.0, 30.0, 40
# where each motion asks most: in the stride, on the way down to the deepest squat, arms and legs at full speed
WINDOWS = {"walk": 0.5, "squat": 0.5, "jumping_jack": 0.3}
LEAD_IN = 1.0  # s
# in the short run: motion, start and lead-in [s], frames: the raised arms press cloth against neck and shoulders
SHORT = ("jumping_jack", WINDOWS["jumping_jack"], 0.5, 10)


def windows(names, frames):
    """A motion, its start, lead-in and frames: a short one, and whole ones as long tests."""
    yield pytest.param(SHORT, id="short")
    for name in names:
        yield pytest.param((name, WINDOWS[name], LEAD_IN, frames), id=name, marks=pytest.mark.long)


@pytest.fixture(scope="module", params=windows(WINDOWS, FRAMES))
def window(request, tshirt):
    """The judged frames of a window, preset live."""
    motion, start, lead_in, frames = request.param
    return run_window(tshirt, motion, start, frames, FPS, "live", lead_in)


@pytest.fixture(scope="module", params=windows(["jumping_jack"], FRAMES // 2))
def draft_window(request, tshirt):
    """Half a window of the fastest motion with the least budget."""
    motion, start, lead_in, frames = request.param
    return run_window(tshirt, motion, start, frames, DRAFT_FPS, "draft", lead_in)


def unclean(frames):
    return {k: f.verdict for k, f in enumerate(frames) if not f.verdict.clean}


def test_dressed_shirt_is_worn(tshirt):
    """Hem around the trunk, collar around the neck, sleeves around the arms."""
    assert len(tshirt.loops) == 4
    heights = [tshirt.x[loop, 1].mean() for loop in tshirt.loops]
    named = dict(zip(np.argsort(heights), range(4)))
    names = tshirt.bone_names()
    assert len(named) == 4
    assert names[int(np.argmin(heights))].startswith("spine")
    assert names[int(np.argmax(heights))].startswith("neck")
    sides = sorted(name for name in names if "arm" in name)
    assert len(sides) == 2
    assert sides[0].startswith("left")
    assert sides[1].startswith("right")


def test_every_frame_is_clean(window):
    """Finite, no cloth through cloth, no cloth through body, nobody inside."""
    assert unclean(window) == {}
    assert sum(f.retries for f in window) == 0


def test_surface_follows_the_skin(window):
    """Where nothing pinches: p95 at most 3 mm and never over 10 mm; where something does, at most 50 mm."""
    for k, frame in enumerate(window):
        assert frame.lag_p95 <= 3e-3, k
        assert frame.lag_max <= 10e-3, k
        assert frame.pinched_lag_max <= 50e-3, k
    print(
        f"lag p95 {1e3 * max(f.lag_p95 for f in window):.2f} mm, max {1e3 * max(f.lag_max for f in window):.1f} mm; "
        f"pinched max {1e3 * max(f.pinched_lag_max for f in window):.1f} mm "
        f"on up to {1e4 * max(f.pinched_area for f in window):.0f} cm^2"
    )


def test_cloth_is_pressed_against_the_body(window, request):
    """In the short window it is: one in which the surface is all at the skin would ask nothing of one."""
    if request.node.callspec.id == "short":
        assert max(frame.lag_max for frame in window) > 1e-3


def test_cloth_stays_within_its_limit(window, tshirt):
    """The fabric's largest principal stretch: 2 % more for a thousandth of the triangles, 10 % more for none."""
    limit = tshirt.fabric.strain_limit
    for k, frame in enumerate(window):
        assert np.quantile(frame.stretch, 0.999) <= 1.02 * limit, k
        assert frame.stretch.max() <= 1.1 * limit, k
    most = max(np.quantile(f.stretch, 0.999) for f in window)
    print(f"stretch {most:.3f} for 99.9 %, {max(f.stretch.max() for f in window):.3f} at most")


def test_shirt_is_still_worn(window):
    """Every boundary loop runs around the bone it ran around when dressed: the linking number with the bone's line."""
    assert [k for k, frame in enumerate(window) if not frame.still_worn] == []


def test_shirt_moves_on_the_body(window):
    """A shirt glued to the skin passes everything above: the hem moves relative to the pelvis."""
    hem = np.array([frame.hem_offset for frame in window])
    assert np.ptp(hem, axis=0).max() > 3e-3


def test_least_budget_gives_up_accuracy_but_never_safety(draft_window):
    """Preset draft, jumping jack: clean and worn in every frame, and on the skin."""
    assert unclean(draft_window) == {}
    assert all(frame.still_worn for frame in draft_window)
    assert max(frame.lag_p95 for frame in draft_window) <= 3e-3
