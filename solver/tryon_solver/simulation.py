"""build(scene, settings) -> Simulation: allocate once, bind the plan, prefactorise; then `advance` at will."""

from __future__ import annotations

import math
import time as clock
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from importlib import import_module
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import scipy.sparse as sp
import warp as wp

from tryon_solver.effects.base import BuildContext
from tryon_solver.effects.registry import bind
from tryon_solver.kernels import compile_kernels
from tryon_solver.linalg.aggregates import Aggregates, aggregate_edges
from tryon_solver.linalg.block_ell import BlockRows
from tryon_solver.linalg.constant_matrices import ConstantMatrices
from tryon_solver.linalg.device_loop import KeptGraph
from tryon_solver.linalg.freed import give_back_freed
from tryon_solver.linalg.order_free import OrderFreeSums
from tryon_solver.linalg.pcg import ConjugateGradients
from tryon_solver.linalg.read_back import read
from tryon_solver.linalg.vectors import find_largest, move_origin
from tryon_solver.materials.device import RestShape
from tryon_solver.materials.stretch import StretchMeter
from tryon_solver.materials.terms import bind_bending, bind_membrane
from tryon_solver.materials.triangle_hessian import TriangleHessian
from tryon_solver.offsets import refuse_what_bears_no_contact
from tryon_solver.plan import NOTHING_GIVEN, Stages, StepPlan
from tryon_solver.results import Counters, StepReport
from tryon_solver.scene import Scene
from tryon_solver.settings import Settings
from tryon_solver.state import State, Workspace, positions
from tryon_solver.step import SCHEMES, advance
from tryon_solver.stepping.arm_contact import FLY, LEAD, arm_contact, may_fly, may_lead
from tryon_solver.stepping.interrupted import take_back
from tryon_solver.stepping.nothing_near import NoCandidates, NoPairs
from tryon_solver.stepping.pace import Hurried, Pace, Unhurried, time_of_iteration
from tryon_solver.stepping.progress import TRUSTED, TRUSTED_AGAIN, Budget, Progress
from tryon_solver.stepping.report import make_report, smallest_gap
from tryon_solver.stepping.start import refuse_touching_start
from tryon_solver.stepping.torn import TearWatch
from tryon_solver.subspace.basis import basis_by_edges, reduced_inverse, reduced_matrix
from tryon_solver.subspace.search import ReducedSearch

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

    from tryon_solver.body.posed import PosedBody
    from tryon_solver.contact.candidates import Candidates
    from tryon_solver.contact.coasting import Coasting
    from tryon_solver.contact.deflect import DeflectionScratch
    from tryon_solver.contact.filtering import Filtering
    from tryon_solver.contact.hold import Holding
    from tryon_solver.contact.pairs import ContactPairs, ContactParameters
    from tryon_solver.contact.region import Region
    from tryon_solver.contact.surfaces import Surface
    from tryon_solver.stepping.fly import Flight
    from tryon_solver.stepping.halve import Halving
    from tryon_solver.stepping.lead import Lead
    from tryon_solver.subspace.contact_coarse import ContactCoarseLevel

FACTOR_DIGITS = 9  # of a step [s]: times of frames are off in their last bits, and no bit of the factor shall be
SAME_STEP = 1e-12  # s by which two steps of one length differ; their matrices are the same

POSED, HALVE = "tryon_solver.body.posed", "tryon_solver.stepping.halve"  # which a scene without a body does not import
WHOLE = ((0.0, 1.0),)  # steps of an interval that none shortens: where each begins and how long it is
BESIDE = ThreadPoolExecutor(max_workers=1, thread_name_prefix="inverse")
"""For inverses that are made while a simulation runs; starts its thread with its first task."""


@dataclass(frozen=True)
class PoseInterval:
    """One solver step's share of the way to a stance of the body (None without one): `dt` s, the first of `left`, all
    or a part of `whole` s, which it would take if carrying tore nothing (stepping/halve.py)."""

    end: Any
    end_time: float
    dt: float
    left: int
    whole: float


class Simulation:
    """A scene on a device. Made by `build`; drive it with `advance`."""

    touching: tuple[Surface, ...] = ()  # what the cloth may touch; with it (stepping/arm_contact.py):
    cloth: Surface
    contact: ContactParameters
    group: wp.array  # (A,) int32: who has the same number never touches
    region: Region
    x_listed: wp.array  # (A,) m, where the candidates' distances were last brought up to
    solved: wp.array  # (A,) m, by which the last step moved the carried state
    expected: wp.array  # (A,) m, by which the solve is to move it in this one, if that is known: `solved` else
    lead: Lead | None = None  # where it may touch a body and itself
    boxes: wp.array
    coasting: Coasting
    flight: Flight | None = None  # where it may touch a body, or is of several pieces
    deflection: DeflectionScratch
    filtering: Filtering
    holding: Holding
    candidates: Candidates  # or what stands for them where it touches nothing, as of the pairs
    pairs: ContactPairs

    def __init__(self, scene: Scene, settings: Settings, device: str) -> None:
        """The first part of building it; `parts` are the others."""
        self.scene, self.settings, self.device = scene, settings, device
        garment = scene.garment
        self.cloth_count = garment.vertex_count
        self.body_count = 0 if scene.body is None else len(scene.body.rest_vertices)
        self.all_count = self.cloth_count + self.body_count
        self.mean_edge = garment.mean_edge_length()  # m, in the pattern
        self.of_one_piece = garment.connectivity.of_one_piece
        self.rest = RestShape.build(garment, scene.of_fabrics("areal_density")[:, 0], device)
        self.mass_told = wp.zeros(1, dtype=wp.float32, device=device)  # kg, `total_mass` where graphs read it
        self.sums = OrderFreeSums(self.all_count, device)
        self.plan = bind_plan(scene, settings, device, self.rest, self.sums)
        self.scheme = SCHEMES[settings.scheme]()
        if scene.body is not None:
            import_module(POSED)
            import_module(HALVE)
        if may_fly(self.plan, garment):
            import_module(FLY)
        if may_lead(self.plan):
            import_module(LEAD)
        compile_kernels(device)  # of what the plan has imported, too
        self.take_shape()
        self.stages = Stages.of(self.plan)
        self.stretch = StretchMeter.build(self.rest)
        self.counters = Counters()
        self.reported = StepReport(0.0, 0, 0, 0, 0, 0.0, settings.d_hat, 1.0, 0.0, 0, 0, 0, 0.0)

    # -- building ------------------------------------------------------------------------------------------------

    def parts(self, pose: Any, surface: np.ndarray | None, basis: csr_matrix | None = None) -> Iterator[None]:
        """Build the rest but for what `use_time_step` makes, a part with each `next`: state, matrices, contacts.
        Arguments as of `build`, and the garment's `basis_by_edges` if that has been made."""
        self._allocate(pose, surface)
        yield
        self._assemble(basis_by_edges(self.scene.garment, self.settings.subspace_spacing) if basis is None else basis)
        yield
        self._prepare_contact()
        yield

    def _allocate(self, pose: Any, surface: np.ndarray | None) -> None:
        scene, device = self.scene, self.device
        self.body: PosedBody | None = None
        skin = np.zeros((0, 3))
        if scene.body is not None:
            if pose is None:
                raise ValueError("a scene with a body needs the pose it starts in")
            self.body = import_module(POSED).PosedBody.build(scene.body, self.cloth_count, pose, device)
            skin = self.body.skin_now.numpy()
        if surface is None:
            surface = skin
        elif surface.shape != skin.shape:
            raise ValueError(f"surface has shape {surface.shape}, the body's vertices have {skin.shape}")
        x: wp.array = wp.array(positions(scene.x_start, surface), dtype=wp.vec3, device=device)
        cloth = wp.zeros(self.cloth_count, dtype=wp.vec3, device=device)
        self.state = State(
            x=x,
            x_committed=wp.clone(x),
            x_start=wp.clone(x),
            x_feasible=wp.clone(x),
            x_hat=wp.clone(cloth),
            v=wp.clone(cloth),
            acceleration=wp.clone(cloth),
            skin=wp.array(skin.astype(np.float32), dtype=wp.vec3, device=device),
            hold=wp.full(self.body_count, self.settings.skin_hold, dtype=wp.float32, device=device),
            dt=wp.zeros(1, dtype=wp.float32, device=device),
        )
        self.work = Workspace.allocate(self.all_count, len(scene.garment.faces), device)
        self.x_before = wp.clone(cloth)
        self.x_searched = wp.clone(x)  # where the contact pairs were collected last
        self.listed = False  # is the candidate list complete around x?
        self.held, self.rests = 0, False  # steps of cloth that stays where it is, alone, and does it rest there?
        self.list_age = 0  # steps since it was found
        self.x_carried = wp.clone(x)  # where the body alone has taken all, before the first contact pass
        self.to_trial = wp.zeros_like(x)
        self.searches = 0
        self.comes_along = False  # in the next `advance`
        self.substeps = 1  # of the body in the last step
        self.largest_out = wp.zeros(1, dtype=wp.float32, device=device)
        self.lag = wp.zeros(1, dtype=wp.float32, device=device)  # m, of the surface behind its skin
        self.went = wp.zeros(2, dtype=wp.float32, device=device)  # by the last step, as in effects/sleep.py
        self.cycles = wp.zeros(3, dtype=wp.int32, device=device)  # as in stepping/repeat.py
        self.most_cycles = wp.zeros(1, dtype=wp.int32, device=device)
        self.cycles_told = 0  # of these, as the device knows
        self.clear = wp.zeros(1, dtype=wp.int32, device=device)  # as in stepping/carry_once.py
        self.under_way = False  # has the device begun to solve by itself (stepping/move_body.py)?
        self.accuracy = wp.zeros(1, dtype=wp.float32, device=device)  # m, as in stepping/near.py
        self.error = wp.zeros(1, dtype=wp.float32, device=device)  # m, as in stepping/estimate.py
        self.graphs: dict[str, KeptGraph] = {}  # by verb, as in stepping/record.py
        self.progress = Progress.allocate(device)
        settings = self.settings
        self.budget = Budget(settings.correction_iterations, settings.pcg_iterations, TRUSTED)
        self.brief_budget = Budget(settings.correction_iterations, settings.correction_pcg_iterations, TRUSTED)
        self.second_budget = Budget(settings.second_iterations, settings.second_pcg_iterations, TRUSTED_AGAIN)
        self.tears = TearWatch.build(self.rest, self.progress.stretch, settings.correction_torn)
        self.halving: Halving | None = None
        if self.body is not None and settings.most_carried is not None:
            carried = self.progress.carried
            self.halving = import_module(HALVE).Halving.build(self.rest, carried, settings.most_carried)
        self.pace: Pace = Unhurried(settings, self.cloth_count)
        self.hurried: Hurried | None = None  # the pace under a deadline, once there was one
        self.buy(settings.accuracy, settings.deadline)
        self.concluded = False  # has the device ended the step by itself (stepping/ending.py)?
        self.figures: Mapping[str, np.ndarray] | None = None  # of that, as in stepping/report.py, if it has
        self.went_back = False  # did the last correction end where it had been nearest to balance?
        self.stood = False  # was the last step void, of those in which nothing led well?

    def _assemble(self, basis: csr_matrix) -> None:
        """Stiffness rows and the subspace; matrices that depend on the time step come with `use_time_step`."""
        garment, device = self.scene.garment, self.device
        joined = [c.joined for c in self.plan.contributions if c.joined is not None]
        pairs = np.vstack(joined) if joined else None
        self.hessian_rows = BlockRows.build(*garment.connectivity.pairs, device, pairs)
        width, repeatable = self.hessian_rows.width, self.settings.deterministic
        self.cg = ConjugateGradients.allocate(self.all_count, self.cloth_count, width, device, repeatable)
        cells = basis_by_edges(garment, aggregate_edges(self.cloth_count))
        self.aggregates = Aggregates.build(cells, device)
        self.triangle_hessian = TriangleHessian.build(self.rest, garment.connectivity, self.hessian_rows.width)
        self.matrices = ConstantMatrices(self.plan.terms, self.hessian_rows, self.cloth_count, device)
        self.basis = basis
        self.mass_per_dt2 = wp.zeros(self.cloth_count, dtype=wp.float32, device=device)
        if self.stages.add_diagonal:  # what of the diagonal is the same in all steps of one length (N,) N/m
            self.steady_diagonal = wp.zeros(self.cloth_count, dtype=wp.float32, device=device)
        self.inverses: dict[int, np.ndarray] = {}  # by `factor_key`, of the shape as it is
        self.inverses_beside = False  # does somebody make them beside the simulation, which then waits for none?
        self.dt = self.whole = 0.0  # s, of the step and of the one that it is a part of
        self.bridged = 0.0  # s, by the last call of `advance` that had any to bridge
        self.coarse: ContactCoarseLevel | None = None
        self._factor_key: int | None = None
        self.spectral_bound = 2.2

    def take_shape(self) -> None:
        """Make what is made of the garment's rest shape: `mass` (N,) kg, `total_mass` kg, and `area` (N,) m^2 of the
        fabric around each vertex, and what the plan's contributions have of it."""
        self.rest.take(self.scene.garment.uv_corners)
        self.mass, self.area = self.rest.mass.numpy().copy(), self.rest.lumped.numpy().copy()
        self.total_mass = float(self.mass.sum())
        self.mass_told.fill_(self.total_mass)
        for contribution in self.plan.contributions:
            if contribution.reshape is not None:
                contribution.reshape()

    @property
    def stiffness_matrix(self) -> csr_matrix:
        """(N, N) float64 N/m, the sum of the constant matrices; rows sum to zero. Waits for the device."""
        return self.matrices.total.matrix()

    def _prepare_contact(self) -> None:
        refuse_what_bears_no_contact(self.scene, self.scene.garment, self.plan.touches)
        if self.plan.touches:
            arm_contact(self)
        else:  # the steps take them for what they stand for
            self.candidates, self.pairs = cast("Candidates", NoCandidates()), cast("ContactPairs", NoPairs(self.device))

    def use_time_step(self, dt: float, whole: float | None = None) -> None:
        """Set the matrices that depend on dt [s]: the exact diagonal always, the reduced factor per half octave.

        Of a step that is a part of `whole` s it is that one's: the search needs about as many iterations with it, and
        none waits for another to be made.
        """
        whole = dt if whole is None else whole
        if abs(dt - self.dt) >= SAME_STEP:
            self.set_diagonals(dt)
        self.whole = whole
        if self.factor_key == self._factor_key:
            return
        if self.factor_key in self.inverses:
            self.use_inverse(self.inverses[self.factor_key])
        elif not self.inverses_beside:
            self.use_inverse(self.reduced_inverse())

    def set_diagonals(self, dt: float) -> None:
        """What steps of dt [s] need besides the reduced factor."""
        self.dt = dt
        self.state.dt.fill_(dt)
        self.mass_per_dt2.assign((self.mass / dt**2).astype(np.float32))
        self.matrices.set_time_step(dt)
        diagonal = self.diagonal(dt)
        held = np.full(self.body_count, self.settings.skin_stiffness)
        self.work.diagonal.assign(np.concatenate([diagonal, held]).astype(np.float32))
        if self.stages.add_diagonal:
            self.steady_diagonal.assign(diagonal.astype(np.float32))
        self._set_coarse_rest(diagonal)

    def diagonal(self, dt: float) -> np.ndarray:
        """(N,) float64 N/m, inertia and what else is on the diagonal alone in steps of dt [s]."""
        diagonal = self.mass / dt**2
        for contribution in self.plan.contributions:
            if contribution.diagonal is not None:
                diagonal = diagonal + contribution.diagonal(dt, self.area)
        return diagonal

    @property
    def factor_key(self) -> int:
        """Steps of the same half octave share a reduced factor, and those that one is halved into have its."""
        return round(2 * math.log2(self.whole))

    def reduced_inverse(self) -> np.ndarray:
        """(M, M) float32 m/N, the reduced matrix's inverse for whole steps as they are now."""
        return self.inverse_to_make()()

    def inverse_to_make(self) -> Callable[[], np.ndarray]:
        """What makes `reduced_inverse` of the matrices as they are now, on another thread if that is to be. What it
        has freed then, several times what it made, is given back."""
        basis, stiffness, diagonal = self.basis, self.stiffness_matrix, self.diagonal(round(self.whole, FACTOR_DIGITS))
        parts = [layer.vertices for layer in self.scene.garment.layers]

        def make() -> np.ndarray:
            inverse = reduced_inverse(basis, stiffness + sp.diags(diagonal), parts)
            give_back_freed()
            return inverse

        return make

    def use_inverse(self, inverse: np.ndarray) -> None:
        """Search the subspace with this inverse, of shape and steps as they are now."""
        self.inverses[self.factor_key] = inverse
        self.make_do_with(inverse)

    def make_do_with(self, inverse: np.ndarray) -> None:
        """Search with this inverse, of another shape and steps as they are now."""
        if self._factor_key is None:
            self.search = ReducedSearch.build(self.basis, inverse, self.settings.history, self.device)
        else:
            self.search.inverse.assign(inverse)
        self._factor_key = self.factor_key

    def _set_coarse_rest(self, diagonal: np.ndarray) -> None:
        """The coarse level's constant matrix for this time step, in the scheme that has one."""
        if self.settings.scheme != "contact_coarse":
            return
        from tryon_solver.subspace.contact_coarse import ContactCoarseLevel  # for who asks for the scheme alone

        if self.coarse is None:
            coarse = basis_by_edges(self.scene.garment, self.settings.coarse_spacing)
            self.coarse = ContactCoarseLevel.build(coarse, self.device)
        self.coarse.rest = reduced_matrix(self.coarse.basis, self.stiffness_matrix + sp.diags(diagonal))

    def buy(self, accuracy: float | None, deadline: float | None) -> None:
        """From the next step on, as if built with these `Settings.accuracy` [m] and `Settings.deadline` [s].

        Raises ValueError as the settings do. Nothing else changes, and nothing is built anew.
        """
        self.settings = settings = replace(self.settings, accuracy=accuracy, deadline=deadline)
        asked = None if accuracy is None else 1.0  # the value is read on the device
        timed = None if deadline is None else 1.0
        self.recorded_settings = replace(settings, accuracy=asked, deadline=timed)  # what graphs are recorded for
        self.accuracy.fill_(accuracy or 0.0)
        if deadline is None:
            self.pace = Unhurried(settings, self.cloth_count)
        elif self.hurried is None:
            self.pace = self.hurried = Hurried(settings, self.device, time_of_iteration(self.reported))
        else:
            self.hurried.buy(settings)  # what parts take it has seen
            self.pace = self.hurried
        most = settings.correction_iterations if settings.ends_by_budget else settings.most_iterations
        self.budget.iterations, self.budget.pcg_iterations = most, settings.pcg_iterations

    # -- running -------------------------------------------------------------------------------------------------

    def start_at(self, cloth: np.ndarray, surface: np.ndarray, pose: Any) -> None:
        """Be elsewhere at the start, at rest: cloth (N, 3) m, collision surface (B, 3) m, the body's stance. What has
        not been simulated yet is then as if it had been built there, `tangled`."""
        x = positions(cloth, surface)
        state = self.state
        searched = (self.x_searched, self.x_carried, *([self.x_listed] if self.touching else []))
        for place in (state.x, state.x_committed, state.x_start, state.x_feasible, *searched):
            place.assign(x)
        self.scene = replace(self.scene, x_start=cloth)
        if self.halving is not None:
            self.halving.times = 0
        if self.lead is not None:
            self.lead.forget()
            self.solved.zero_()
        if self.body is not None:
            body = self.body
            body.stand(pose)
            body.felt.zero_()
            for skin in (body.skin_next, state.skin):
                wp.copy(skin, body.skin_now)

    def advance(self, pose: Any, time: float, longest_step: float = 0.0) -> StepReport:
        """From the last simulated pose time to `time` [s] at `pose`: Algorithm 2 (step.py).

        `longest_step` [s] lets steps be longer than the settings' `largest_step`, for who must keep up with a clock.
        Whatever is raised: cloth and surface are then where the step that was under way began, and may be advanced.
        """
        wp.copy(self.state.x_committed, self.state.x)
        try:
            report = advance(self, pose, time, longest_step)
        except Exception:
            take_back(self)
            raise
        self.comes_along = False
        return report

    def come_along(self) -> None:
        """In the next `advance` the cloth goes with the body as if the room moved: it feels nothing of that motion,
        what speed it had is gone, and in the end it has the body's. For a garment that nobody sees on its way; what of
        it has fallen from the body goes its own (stepping/fly.py)."""
        self.comes_along = self.body is not None

    def move_origin(self, by: np.ndarray) -> None:
        """See the same scene from an origin (3,) whole metres away; later poses are given relative to the new one.

        Subtracting a whole number from a float32 that is nearer to it than to zero is exact: gaps stay what they are.
        """
        if not (np.asarray(by) == np.round(by)).all():
            raise ValueError(f"the origin moves by whole metres, not by {np.asarray(by).tolist()}")
        state, shift = self.state, wp.vec3(*(float(value) for value in by))
        places = [state.x, state.x_committed, state.x_start, state.x_feasible, state.x_hat, state.skin]
        if self.body is not None:
            places += [self.body.skin_now, self.body.skin_next]
            self.body.pose = self.body.moving.moved(self.body.pose, -np.asarray(by))
        places += [c.values["places"] for c in self.plan.contributions if "places" in c.values]
        for place in places:
            move_origin(place, shift)

    def pose_intervals(self, pose: Any, time: float, longest_step: float = 0.0) -> Iterator[PoseInterval]:
        """Cut the way to `pose` at `time` into steps of at most `largest_step`, or `longest_step` if that is longer;
        into shorter ones where carrying tears the cloth (stepping/halve.py), which each shows of those after it.

        A gap over `longest_gap` (or that) is bridged at so much per call; what is left is the report's debt, made up
        later.
        """
        start_time = self.state.time
        gap = time - start_time
        if gap <= 0:
            return
        bridged = min(gap, max(self.settings.longest_gap, longest_step))
        self.debt, self.bridged = gap - bridged, bridged
        count = max(1, math.ceil(bridged / max(self.settings.largest_step, longest_step) - 1e-9))
        first = self.body.pose if self.body else pose
        share = bridged / gap
        for k in range(count):
            for begun, size in WHOLE if self.halving is None else self.halving.parts():
                done = (k + begun + size) / count
                end = self.stance_between(first, pose, share * done)
                left = math.ceil((count - k - begun) / size)
                yield PoseInterval(end, start_time + bridged * done, bridged * size / count, left, bridged / count)

    def awake(self, intervals: Iterator[PoseInterval]) -> Iterator[PoseInterval]:
        """Those of the intervals that are to be simulated: all of them but for what effects pass over."""
        for pass_over in self.stages.sleep:
            intervals = pass_over(self, intervals)
        return intervals

    def stance_between(self, first: Any, last: Any, share: float) -> Any:
        """The body's stance at `share` of the way; whatever was given for a scene without a body."""
        if self.body is None or first is None or last is None:
            return first
        return last if share >= 1.0 else self.body.moving.between(first, last, share)

    def wake(self) -> None:
        """Simulate from now on, until nothing has moved for long enough again (effect Sleep)."""
        self.state.asleep, self.state.still = False, 0.0

    def commit(self, interval: PoseInterval) -> None:
        """The interval is simulated: the clock is at its end, the body's pose where the body has come to."""
        self.state.time = interval.end_time
        if self.body is not None and interval.end is not None:
            self.body.pose = self.body.reached[0]
        self.counters.steps += 1

    def timed(self, verb: Callable[..., None], *arguments: object) -> None:
        """Run a verb and add its wall time to the report under its name."""
        begun = clock.perf_counter()
        verb(self, *arguments)
        times = self.counters.times
        times[verb.__name__] = times.get(verb.__name__, 0.0) + 1e3 * (clock.perf_counter() - begun)

    def largest(self, vectors: wp.array) -> float:
        """Largest length among the vectors [their unit]."""
        find_largest(vectors, self.largest_out)
        return float(read(self.largest_out)[0][0])

    def tell_cycles(self, most: int) -> None:
        """Let the next step's cycles be no more than that."""
        if most != self.cycles_told:
            self.most_cycles.fill_(most)
            self.cycles_told = most

    # -- reporting -----------------------------------------------------------------------------------------------

    def start_report(self) -> None:
        """Forget the figures of the last call of `advance`."""
        self.pace.begin()
        self.counters = Counters()
        self.cycles.zero_()
        self.error.zero_()
        self.debt = 0.0

    def report(self) -> StepReport:
        """Figures of the call of `advance` that is ending."""
        self.reported = make_report(self)
        return self.reported

    def smallest_gap(self) -> tuple[float, float]:
        """Smallest gap of a contact pair at x above its offset, and that offset [m]; collects the pairs at x."""
        return smallest_gap(self)

    def stretches(self) -> np.ndarray:
        """(F,) float32, larger principal stretch of each triangle."""
        return self.stretch.larger(self.state.x)

    def cloth_positions(self) -> np.ndarray:
        """(N, 3) float32 m."""
        return self.state.x.numpy()[: self.cloth_count].copy()

    def body_positions(self) -> np.ndarray:
        """(B, 3) float32 m, the simulated collision surface."""
        return self.state.x.numpy()[self.cloth_count :].copy()


def build(
    scene: Scene,
    settings: Settings | None = None,
    device: str = "cpu",
    pose: Any = None,
    surface: np.ndarray | None = None,
    tangled: bool = False,
) -> Simulation:
    """A simulation of the scene at rest in its start position.

    `pose` is the body's stance there, a Pose or a Moment of a sequence; `device` "cpu" or "cuda:0"; `surface` (B, 3) m
    the collision surface that the start position is free of, where it has yielded; without it the skin. `tangled`: the
    start may touch and cross, dressing.untangle comes next. Raises GarmentError when the mesh can't carry the fabric's
    thickness, or when the start touches or crosses, naming the place; ValueError when the settings ask for a
    determinism that the device does not have.
    """
    settings = settings or Settings()
    simulation = Simulation(scene, settings, device)
    for _ in simulation.parts(pose, surface):
        pass
    simulation.use_time_step(settings.largest_step)
    if not tangled:
        refuse_touching_start(simulation)
    return simulation


def bind_plan(scene: Scene, settings: Settings, device: str, rest: RestShape, sums: OrderFreeSums) -> StepPlan:
    """Bind the materials and the scene's effects; those with nothing to do are left out, and the plan says why."""
    bending = bind_bending(scene.garment, scene.of_fabrics("k_bend")[:, 0], rest, device)
    own, rows = (None, None) if bending is None else bending
    context = BuildContext(scene, settings, device, rest, rows, sums)
    bound = [bind_membrane(scene.garment, scene.of_fabrics("k_warp", "k_weft", "k_shear"), rest, device), own]
    idle = []
    for effect in scene.effects:
        why = effect.idle(scene)
        contribution = None if why else bind(effect, context)
        bound.append(contribution)
        if contribution is None:
            idle.append((effect.module.rpartition(".")[2], why or NOTHING_GIVEN))
    return StepPlan(tuple(c for c in bound if c is not None), tuple(idle))
