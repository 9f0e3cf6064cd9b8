"""Settings and numbers at their ends: activation distance, time step, budget, buffers, gravity, place."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from harness.kit import FREE, alone, layers, rippled, step_of, turned
from harness.scene import Ask, HardScene, Run
from harness.wearer import COMES_TO_REST, moving, put_on, walked
from small_scenes import icosphere, rigid_body

from tryon_solver.body.pose import Pose
from tryon_solver.contact.candidates import Candidates
from tryon_solver.contact.pairs import ContactPairs
from tryon_solver.scene import Gravity, Scene
from tryon_solver.simulation import build
from tryon_solver.stepping.search import search_around

RADIUS = 0.08
UPRIGHT = np.array([[0.0, 0.0, 0.0, 1.0]])


def over_ball(ask: Ask, place: tuple[float, float, float] = (0.0, 0.0, 0.0), clearance: float = 0.006) -> Run:
    """Two squares, one upon the other and turned, dropped over a ball: contact with the body and with cloth, folds.

    `place` m is where the scene is; `clearance` m what lies between layers at the start.
    """
    n = max(5, round(np.sqrt(ask.vertices / 2)))
    garment, x = layers(2, n, n, 0.26, 0.0)
    lower, upper = (rippled(sheet, 1e-3) for sheet in np.split(x, 2))
    above = RADIUS + clearance + 0.002
    x = np.vstack([turned(lower, 0.2) + [0.003, above, 0.002], turned(upper, 0.7) + [0, above + clearance, 0.001]])
    ball = rigid_body(*icosphere(RADIUS, 3))
    stance = Pose(np.array(place, np.float64), UPRIGHT)
    sim = build(Scene(garment, x + place, ball), ask.settings, ask.device, stance)
    # steps too long to tell trembling by: all motion is asked about
    quiet = 3.5 if step_of(sim) > 1 / 20 else None
    return Run(sim, lambda _t: stance, step_of(sim), stops=1.5, quiet=quiet)


def with_settings(**values: float | int) -> Callable[[Ask], Run]:
    """The scene over the ball with some settings changed."""

    def set_up(ask: Ask) -> Run:
        clearance = max(0.006, 1.2 * float(values.get("d_hat", 0.0)) + 2.5e-3)
        settings = replace(ask.settings, **values)  # type: ignore[arg-type]
        return over_ball(replace(ask, settings=settings), clearance=clearance)

    return set_up


def made_void(ask: Ask) -> Run:
    """A T-shirt on a walk; until it stops a velocity is not a number in every 20th step, and in five in a row."""
    stance, stops = walked(0.5 * ask.seconds)
    run = moving(put_on(ask, "tshirt"), stance, stops, quiet=stops + COMES_TO_REST["tshirt"])
    state = run.sim.state

    def drive(t: float) -> None:
        frame = round(t / run.dt)
        if t <= stops and (frame % 20 == 0 or 70 < frame <= 75):
            v = state.v.numpy()
            v[frame % len(v), 1] = np.nan
            state.v.assign(v)

    run.drive = drive
    return run


def worn_with_settings(**values: float | int) -> Callable[[Ask], Run]:
    """A T-shirt in three seconds of jumping jacks, stopped dead, with some settings changed once it is dressed."""

    def set_up(ask: Ask) -> Run:
        changed = replace(ask.settings, **values)  # type: ignore[arg-type]
        stance, stops = walked(3.0, "jumping_jack")
        sim = put_on(replace(ask, settings=changed), "tshirt")
        return moving(sim, stance, stops, quiet=stops + COMES_TO_REST["tshirt"])

    return set_up


def with_small_buffers(ask: Ask) -> Run:
    """Room for 16 candidates and 16 pairs at the start: both have to grow, and nothing may be dropped."""
    run = over_ball(ask)
    sim = run.sim
    sim.candidates = Candidates.allocate(16, ask.device)
    sim.pairs = ContactPairs.allocate(16, ask.device)
    sim.work.direction.zero_()
    search_around(sim, sim.state.x, sim.work.direction)  # the list that was there before held all of the start
    return run


def thrown_without_gravity(ask: Ask) -> Run:
    """Two sheets fly at each other at 2 m/s where nothing falls."""
    n = max(5, round(np.sqrt(ask.vertices / 2)))
    garment, x = layers(2, n, n, 0.25, 0.0)
    lower, upper = np.split(x, 2)
    x = np.vstack([rippled(lower, 2e-3), turned(rippled(upper, 2e-3), 0.5) + [0, 0.03, 0]])
    sim = alone(ask, garment, x, effects=tuple(e for e in FREE if not isinstance(e, Gravity)))
    speed = np.repeat([[0, 1.0, 0], [0, -1.0, 0]], len(lower), axis=0)
    sim.state.v.assign(speed.astype(np.float32))
    return Run(sim, dt=step_of(sim), stops=1.5, parts=True)


BUDGET = {
    "outer_iterations": 1,
    "reduced_iterations": 1,
    "smoothing_sweeps": 1,
    "correction_iterations": 1,
    "correction_pcg_iterations": 1,
    "second_iterations": 0,
    "second_pcg_iterations": 1,
    "deflection_passes": 1,
    "searches": 1,
}
FAR = "float32 resolves {} there: the figure is stated, not judged"

SCENES = (
    *(
        HardScene(f"d_hat_{1e3 * d:g}mm", f"contact acts from {1e3 * d:g} mm", with_settings(d_hat=d))
        for d in (0.1e-3, 0.5e-3, 5e-3, 20e-3)
    ),
    *(
        HardScene(f"step_1_{n}", f"steps of 1/{n} s", with_settings(largest_step=1 / n), seconds=seconds, rate=n)
        for n, seconds in ((15, 5.0), (30, 5.0), (120, 5.0), (1000, 3.0))
    ),
    HardScene(
        "one_iteration",
        "every budget of iterations cut to 1: nothing crosses, far from balance",
        with_settings(**BUDGET),
    ),
    HardScene(
        "worn_one_iteration",
        "the same, a T-shirt in jumping jacks: nothing crosses, and the surface that lags catches up",
        worn_with_settings(**BUDGET),
        vertices=600,
        seconds=8.0,
    ),
    HardScene(
        "void_steps",
        "a T-shirt whose velocities are not numbers now and then: such steps are void, told so, and it goes on",
        made_void,
        stated=dict.fromkeys(
            ("energy without work (share of what is at play)", "stretch, 99.9 %", "stretch, max"),
            "no force acts while steps are void, the body carries the cloth: the figure is stated, not judged",
        ),
    ),
    HardScene("buffers_of_16", "lists of candidates and pairs with room for 16 at first", with_small_buffers),
    HardScene("zero_gravity", "two sheets thrown at each other where nothing falls", thrown_without_gravity),
    HardScene(
        "at_100m",
        "100 m from the origin in float32",
        lambda ask: over_ball(ask, (100.0, 0.0, -100.0)),
        stated={"energy without work at rest (share)": FAR.format("8 micrometres")},
    ),
    HardScene(
        "at_10km",
        "10 km from the origin in float32, which resolves 1 mm there",
        lambda ask: over_ball(ask, (10_000.0, 0.0, -10_000.0)),
        stated={
            name: FAR.format("1 mm")
            for name in (
                "trembling [m/s]",
                "energy without work (share of what is at play)",
                "energy without work at rest (share)",
                "stretch, 99.9 %",
                "stretch, max",
                "reported lag off by [m]",
            )
        },
    ),
)
