"""StepPlan: per stage of the step, the functions of the contributions the scene asked for, and nothing else."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import warp as wp

from tryon_solver.linalg.block_ell import BlockRows
from tryon_solver.linalg.constant_matrices import Term
from tryon_solver.state import State

if TYPE_CHECKING:
    from tryon_solver.contact.pairs import ContactPairs
    from tryon_solver.linalg.dyad import Dyad
    from tryon_solver.simulation import PoseInterval, Simulation


@dataclass(frozen=True)
class ContactTerm:
    """A force that acts within contact pairs besides the barrier, such as friction.

    `make_room(pairs)` allocates for as many pairs as there is room for, and `room()` says for how many its arrays have
    room, which stay in place while that stands; `prepare(pairs, state, x, x_before)` freezes what is lagged: for one
    iteration at x, which the last one reached from x_before, or with None in its place for a model that holds away from
    x as well; `add_gradient(pairs, state, x, gradient_out)`, of as many vertices as that is long, once the simulation's
    `sums` settle there; `add_stiffness(pairs)` adds its matrices to `pairs.beside`; `tangential(pairs)` (size,) float64
    N/m, its stiffness across the normal; `remember(pairs, state)` keeps for the next step how far each pair has given
    at the end of this one; `kept()` returns that, (P, 4) int32 vertices and (P, 3) float32 m, and `restore(ids, given)`
    takes it up again; `restrain(pairs, move)` shortens a move (A,) vec3 m of the cloth from where the pairs were
    collected that would pass by a balance on its way.
    """

    make_room: Callable[[ContactPairs], None]
    room: Callable[[], int]
    prepare: Callable[[ContactPairs, State, wp.array, wp.array | None], None]
    add_gradient: Callable[[ContactPairs, State, wp.array, wp.array], None]
    add_stiffness: Callable[[ContactPairs], None]
    tangential: Callable[[ContactPairs], np.ndarray]
    remember: Callable[[ContactPairs, State], None]
    kept: Callable[[], tuple[np.ndarray, np.ndarray]]
    restore: Callable[[np.ndarray, np.ndarray], None]
    restrain: Callable[[ContactPairs, wp.array], None] | None = None


@dataclass(frozen=True)
class Contribution:
    """One effect or material, and the stages of the step it takes part in. None: not in that stage.

    `start_step` freezes what holds for a whole step, once the state it starts from is known. `project` takes part in
    every local step; `project_in_correction` only in the correction, for a term whose weight would spoil projective
    dynamics' constant matrix; `add_velocity_gradient` and `add_velocity_gradient_in_correction` likewise.
    `add_triangle_hessian` adds a positive semidefinite Hessian over each triangle's deformation gradient
    (materials/triangle_hessian.py), `add_hessian` one over pairs of vertices that share a triangle, and over those of
    `joined`; where `stiffness` is exactly the Hessian, it says so and nothing has to be added. `stiffness` (N, N) N/m
    enters projective dynamics' constant matrix; `rate_stiffness` (N, N) N s/m, over dt, the correction's. Rows of all
    three must sum to zero, as those of inner forces do: the correction multiplies by differences. What holds the cloth
    to a place is `diagonal(dt, area)` (N,) float64 N/m, which enters both beside the inertia, of the fabric's area (N,)
    m^2 around each vertex; what of it is another in every step, `add_diagonal(state, diagonal_out)` adds on the device
    once a step, after `start_step`, (N,) float32 N/m. `dyad` is what of the Hessian is dense, c w w^T, for the
    correction alone. `led` (K,) are vertices that the body leads, whatever is near. `touches` names the surfaces the
    cloth may touch: "cloth", "body"; `sleep` passes over intervals of time in which nothing is to be done; `measure`
    puts what it has to know for that of a step that has ended into the simulation's `went`. `reshape`
    makes anew, in place, what was made of the rest shape, once that has changed (reshape.py): what works with it need
    not know.
    """

    name: str
    add_acceleration: Callable[[wp.array], None] | None = None  # acceleration_out (N,)
    project: Callable[[wp.array, wp.array], None] | None = None  # x, corner_gradient_out
    project_in_correction: Callable[[wp.array, wp.array], None] | None = None  # x, corner_gradient_out
    add_gradient: Callable[[wp.array, wp.array], None] | None = None  # x, gradient_out
    start_step: Callable[[State], None] | None = None  # state
    add_velocity_gradient: Callable[[State, wp.array, wp.array], None] | None = None  # state, x, gradient_out
    add_velocity_gradient_in_correction: Callable[[State, wp.array, wp.array], None] | None = None  # likewise
    add_triangle_hessian: Callable[[wp.array, wp.array], None] | None = None  # x, hessians_out (F, 3)
    add_hessian: Callable[[wp.array, BlockRows], None] | None = None  # x, rows
    joined: npt.NDArray[np.int32] | None = None  # (K, 2) pairs of vertices
    note_joined: Callable[[wp.array, wp.array], None] | None = None  # piece_of (N,), touched_out (P,) int32
    stiffness: Term | None = None
    rate_stiffness: Term | None = None
    diagonal: Callable[[float, np.ndarray], np.ndarray] | None = None
    add_diagonal: Callable[[State, wp.array], None] | None = None  # state, diagonal_out
    dyad: Dyad | None = None
    led: np.ndarray | None = None
    touches: tuple[str, ...] = ()
    contact: ContactTerm | None = None
    sleep: Callable[[Simulation, Iterator[PoseInterval]], Iterator[PoseInterval]] | None = None  # those to simulate
    measure: Callable[[Simulation], None] | None = None
    energy: Callable[[wp.array], float] | None = None  # x -> J, for tests and reports
    reshape: Callable[[], None] | None = None
    values: Mapping[str, wp.array] = field(default_factory=dict)  # device arrays that may be written between frames


NOTHING_GIVEN = "it is given nothing to act on, or by nothing"


@dataclass(frozen=True)
class StepPlan:
    """The bound contributions in the order in which they act; `idle`: names of effects that the scene asks for and that
    have nothing to do in it, each with why, for people."""

    contributions: tuple[Contribution, ...]
    idle: tuple[tuple[str, str], ...] = ()

    def stage(self, name: str) -> tuple[Callable[..., object], ...]:
        """The functions of one stage, in order."""
        return tuple(f for f in (getattr(c, name) for c in self.contributions) if f is not None)

    @property
    def touches(self) -> tuple[str, ...]:
        """Surfaces the cloth may touch in this scene."""
        return tuple(dict.fromkeys(s for c in self.contributions for s in c.touches))

    @property
    def terms(self) -> tuple[Term, ...]:
        """Of the constant matrices, in the order in which they are added."""
        return tuple(t for c in self.contributions for t in (c.stiffness, c.rate_stiffness) if t is not None)

    def describe(self, times: Mapping[str, Mapping[str, float]] | None = None) -> str:
        """Stages and the contributions in them, one line each; behind a name the ms of a call, where `times` has them
        (stepping/clocked.py measures them). Then, a line each, what has nothing to do, and why."""
        stages = (
            "add_acceleration",
            "project",
            "project_in_correction",
            "add_gradient",
            "start_step",
            "add_velocity_gradient",
            "add_velocity_gradient_in_correction",
            "add_triangle_hessian",
            "add_hessian",
            "stiffness",
            "rate_stiffness",
            "diagonal",
            "add_diagonal",
            "dyad",
            "touches",
            "contact",
            "sleep",
            "measure",
        )
        lines = []
        for stage in stages:
            names = [named(c.name, stage, times or {}) for c in self.contributions if takes_part(c, stage)]
            lines.append(f"{stage}: {', '.join(names) if names else '-'}")
        lines += [f"not in the step: {name}, {why}" for name, why in self.idle]
        return "\n".join(lines)


def named(name: str, stage: str, times: Mapping[str, Mapping[str, float]]) -> str:
    """The name, with what a call takes; of a surface that is touched with what each part of contact does."""
    own = times.get(name, {})
    if stage == "touches" and own:
        return f"{name} ({', '.join(f'{part} {taken:.3f} ms' for part, taken in own.items())})"
    return f"{name} {own[stage]:.3f} ms" if stage in own else name


def takes_part(contribution: Contribution, stage: str) -> bool:
    """Does the contribution act in this stage?"""
    entry = getattr(contribution, stage)
    return entry is not None and not (isinstance(entry, tuple) and not entry)


@dataclass(frozen=True)
class Stages:
    """The plan's functions by stage, resolved once."""

    add_acceleration: tuple[Callable[..., object], ...]
    project: tuple[Callable[..., object], ...]
    project_in_correction: tuple[Callable[..., object], ...]
    add_gradient: tuple[Callable[..., object], ...]
    start_step: tuple[Callable[..., object], ...]
    add_velocity_gradient: tuple[Callable[..., object], ...]
    add_velocity_gradient_in_correction: tuple[Callable[..., object], ...]
    add_triangle_hessian: tuple[Callable[..., object], ...]
    add_hessian: tuple[Callable[..., object], ...]
    add_diagonal: tuple[Callable[..., object], ...]
    dyads: tuple[Dyad, ...]
    contact: tuple[ContactTerm, ...]
    sleep: tuple[Callable[..., Iterator[PoseInterval]], ...]
    measure: tuple[Callable[..., object], ...]

    @staticmethod
    def of(plan: StepPlan) -> Stages:
        """All stages of the plan."""
        return Stages(
            add_acceleration=plan.stage("add_acceleration"),
            project=plan.stage("project"),
            project_in_correction=plan.stage("project_in_correction"),
            add_gradient=plan.stage("add_gradient"),
            start_step=plan.stage("start_step"),
            add_velocity_gradient=plan.stage("add_velocity_gradient"),
            add_velocity_gradient_in_correction=plan.stage("add_velocity_gradient_in_correction"),
            add_triangle_hessian=plan.stage("add_triangle_hessian"),
            add_hessian=plan.stage("add_hessian"),
            add_diagonal=plan.stage("add_diagonal"),
            dyads=tuple(c.dyad for c in plan.contributions if c.dyad is not None),
            sleep=tuple(c.sleep for c in plan.contributions if c.sleep is not None),
            measure=plan.stage("measure"),
            contact=tuple(c.contact for c in plan.contributions if c.contact is not None and plan.touches),
        )
