"""Steps with contact against full Newton in float64 of the same discrete energy. Whole: `make reference`."""

from dataclasses import replace

import numpy as np
import pytest
from against_reference import one_step_error, reference_steps, rms
from contact_scenes import DT, SCENES

from tryon_solver.settings import PRESETS

GRAVITY = np.array([0, -9.81, 0])
LIVE = PRESETS["live"]
CONVERGED = replace(LIVE, contact_passes=20)
# steps of each scene; contact has begun by then
WINDOWS = {"square": 7, "damped square": 7, "strip below mu": 5, "strip above mu": 5, "sleeve": 3, "sheets": 3}


@pytest.fixture(scope="module", params=WINDOWS)
def window(request):
    """A scene and its reference's first steps."""
    case = SCENES[request.param]()
    steps = list(reference_steps(case, WINDOWS[request.param]))
    assert max(step.last_move for step in steps) <= 1e-8
    # cloth that only fell, as without contact, would be far off
    fallen = [
        rms(s.after.x[:n] - s.before.x[:n] - DT * s.before.v - DT**2 * GRAVITY)
        for s in steps
        for n in [len(s.before.v)]
    ]
    assert max(fallen) > 1e-3
    return case, steps


def test_one_step_at_the_budget_of_live(window):
    """RMS at most 0.5 mm from the reference's own states."""
    case, steps = window
    errors = [one_step_error(case, step, LIVE) for step in steps]
    print(f"{case.name}: {', '.join(f'{1e3 * e:.4f}' for e in errors)} mm")
    assert max(errors) <= 0.5e-3


def test_contact_passes_lead_to_the_reference(window):
    """Repeated until the full energy's residual is below tolerance: RMS at most 0.05 mm."""
    case, steps = window
    errors = [one_step_error(case, step, CONVERGED) for step in steps]
    print(f"{case.name}: {', '.join(f'{1e3 * e:.4f}' for e in errors)} mm")
    assert max(errors) <= 0.05e-3
