"""Numerical settings: what accuracy is bought and what it may cost. Validated on construction."""

from __future__ import annotations

from dataclasses import dataclass, replace
from numbers import Real

SCHEME_NAMES = ("subspace_lbfgs", "contact_coarse")


@dataclass(frozen=True)
class Settings:
    """How a scene is solved. Lengths in m, times in s.

    The defaults are the preset `live`.
    """

    scheme: str = "subspace_lbfgs"
    """Which cycle solves the proxy problem: `subspace_lbfgs` is the paper's, `contact_coarse` ours (step.py)."""
    coarse_iterations: int = 3
    """Conjugate-gradient iterations a cycle, scheme `contact_coarse`."""
    coarse_spacing: float = 10.0
    """Spacing of that scheme's coarse grid, in mean edge lengths."""
    largest_step: float = 1 / 60
    """Longest solver step [s]."""
    longest_gap: float = 0.1
    """Most time one call of `advance` bridges [s]; a longer gap in the poses is made up over several calls."""
    outer_iterations: int = 4
    """Cycles of [reduced search, smoothing, local projections] per step, at most."""
    reduced_iterations: int = 2
    smoothing_sweeps: int = 5
    history: int = 8
    """L-BFGS pairs kept within a step."""
    tolerance: float = 1e-3
    """A step's cycles stop when the largest move of a cycle falls below tolerance * dt [m/s * s]."""
    subspace_spacing: float = 4.0
    """Spacing of the spline grid, in mean edge lengths."""
    correction_iterations: int = 12
    """Newton iterations of the penetration correction, at most."""
    correction_extensions: int = 3
    """How often that budget is given once more in a step where it ends in the middle of a snap, or not near enough, at
    most."""
    correction_unsettled: float = 0.05
    """A budget that came hardly nearer to balance ended too early where moves longer than this times dt are to come
    [m/s * s]."""
    correction_nearness: float | None = None
    """Near enough to balance, estimated as a root mean square, times dt [m/s * s], and by twenty times the energy that
    cloth has at this speed (stepping/near.py): a correction that is nearer ends before its budget, but for cloth that
    hardly moves, and one that is not is extended. None: neither.
    """
    late_nearness: float = 0.1
    """Near enough where a deadline has passed, estimated likewise [m/s * s]: a correction that is not goes on, late as
    it is, for as many iterations as it has without a deadline."""
    correction_pcg_iterations: int = 80
    correction_pcg_tolerance: float = 1e-2
    """Relative residual at which the correction's conjugate gradients stop."""
    correction_torn: float | None = None
    """Largest stretch of a triangle beyond which a correction is done again with a budget of its own, until that leaves
    it so (stepping/torn.py). None: none is."""
    second_iterations: int = 24
    """Newton iterations of a correction that is done again, because the first one led astray; 0: none is."""
    second_pcg_iterations: int = 80
    """Conjugate gradients of each of these, at most."""
    correction_tolerance: float = 1e-4
    """The correction stops when its largest Newton move falls below this times dt [m/s * s]: a tenth of the trembling
    that is told from rest."""
    contact_passes: int = 1
    """How often a step makes the contact proxy, solves and corrects, at most; each time from where the last one ended.

    More than one repeats until a correction ends below its tolerance: the step of the full energy, whatever it costs.
    """
    d_hat: float = 2e-3
    """Gap at which contact begins to act [m]."""
    body_offset: float = 1.5e-3
    """Thickness the skin adds to every contact with it [m]; the fabric adds half its own."""
    pressure_stiffness: float = 1e6
    """Stiffness of contact per area of cloth [N/m^3]."""
    skin_stiffness: float = 1000.0
    """How strongly a vertex of the collision surface is held to the tracked skin [N/m], while it is close."""
    skin_hold: float = 1.0
    """Force at which a vertex of the collision surface yields [N]: cloth caught in a fold moves it, tension doesn't."""
    skin_firmness: float = 30.0
    """How much more it resists the further it has yielded [N/m], so that two sheets that press cloth share the way."""
    return_speed: float = 0.4
    """How fast a surface that yielded returns to the skin [m/s]."""
    substep_travel: float = 8e-3
    """Longest motion of the body relative to its pelvis in one kinematic sub-step [m]."""
    most_substeps: int = 32
    """Of these in a step; the body goes no further in it, 15 m/s in `draft` and `live`, 31 m/s in `fit`."""
    most_carried: float | None = 0.5
    """Stretch that carrying cloth along with the body may add to a triangle in a step [-]; the steps after one that
    adds more are half as long, a quarter or an eighth (stepping/halve.py). None: they are not shortened."""
    hardest_kick: float = 3.0
    """Change of the body's velocity from one step to the next that the cloth feels as it is [m/s]; beyond, less of it:
    nobody jerks so hard, a tracker has slipped (stepping/leap.py)."""
    carry_full: float = 0.015
    carry_none: float = 0.06
    """Cloth within `carry_full` of the skin is carried along with it, beyond `carry_none` with the pelvis [m]."""
    deflection_passes: int = 16
    """Passes that turn a motion aside where it would close a gap, before it is shortened."""
    searches: int = 12
    """How often the list of candidates is extended in one correction, at most; then vertices stay where it reaches."""
    search_slack: float = 2e-3
    """How far from where it is expected a vertex may go before candidates are searched for again, at most [m]; on fine
    cloth it is less (stepping/search.py)."""

    accuracy: float | None = None
    """RMS distance from balance at which a step may end, as estimated [m] (stepping/near.py): the correction goes on
    until there, whatever its budget, or until Newton's ways have not become shorter for long. None: it ends by its
    budget."""
    deadline: float | None = None
    """What a call of `advance` may take [s] (stepping/pace.py): the correction goes on for as long as that allows, and
    cycles are fewer where it must be. None: a call takes what it takes."""
    most_iterations: int = 100
    """Newton iterations of a correction that ends by `accuracy` or `deadline`, at most."""
    most_pcg_iterations: int = 80
    """Conjugate gradients of each of these, at most, if more than those of the budget: short ones do for a budget of a
    few, and lead nowhere from an impact."""
    most_searches: int = 100
    """Searches there, if more than `searches`: what stands where its candidates end comes no nearer."""

    deterministic: bool = False
    """Two runs of a scene on a device end in equal bytes. On a CPU they always do; a GPU's conjugate gradients take two
    fifths longer for it, and motions are shortened somewhat more. None that goes by a `deadline` does."""

    def __post_init__(self) -> None:
        if self.scheme not in SCHEME_NAMES:
            raise ValueError(f"settings.scheme must be one of {', '.join(SCHEME_NAMES)}, not {self.scheme!r}")
        if self.deterministic and self.deadline is not None:
            raise ValueError("settings.deterministic: nothing that goes by a clock repeats; leave out the deadline")
        positive = (
            "largest_step",
            "longest_gap",
            "tolerance",
            "subspace_spacing",
            "coarse_spacing",
            "late_nearness",
            "correction_pcg_tolerance",
            "correction_tolerance",
            "correction_unsettled",
            "d_hat",
            "body_offset",
            "pressure_stiffness",
            "skin_stiffness",
            "skin_hold",
            "skin_firmness",
            "return_speed",
            "substep_travel",
            "hardest_kick",
            "carry_full",
            "search_slack",
        )
        may_be_none = ("accuracy", "deadline", "correction_nearness", "correction_torn", "most_carried")
        for name in (*positive, *(name for name in may_be_none if getattr(self, name) is not None)):
            value = getattr(self, name)
            if not isinstance(value, Real) or isinstance(value, bool) or not 0 < float(value) < float("inf"):
                raise ValueError(f"settings.{name} must be a finite number above 0, not {value!r}")
        counts = (
            "outer_iterations",
            "correction_iterations",
            "correction_pcg_iterations",
            "second_pcg_iterations",
            "most_iterations",
            "most_pcg_iterations",
            "most_searches",
            "contact_passes",
            "history",
            "most_substeps",
            "searches",
            "coarse_iterations",
        )
        for name in counts:
            value = getattr(self, name)
            if not (isinstance(value, int) and value >= 1):
                raise ValueError(f"settings.{name} must be a whole number of at least 1, not {value!r}")
        optional = (
            "reduced_iterations",
            "smoothing_sweeps",
            "deflection_passes",
            "correction_extensions",
            "second_iterations",
        )
        for name in optional:
            value = getattr(self, name)
            if not (isinstance(value, int) and value >= 0):
                raise ValueError(f"settings.{name} must be a whole number of at least 0, not {value!r}")
        if self.carry_none <= self.carry_full:
            raise ValueError("settings.carry_none must be larger than settings.carry_full")

    @property
    def ends_by_budget(self) -> bool:
        """Does a correction end by its budget, and by nothing else that is asked for?"""
        return self.accuracy is None and self.deadline is None

    @property
    def ends_by_accuracy(self) -> bool:
        """Does a correction end by its accuracy, in whatever time?"""
        return self.accuracy is not None and self.deadline is None

    @property
    def pcg_iterations(self) -> int:
        """Conjugate gradients of each of the correction's iterations, at most."""
        budget = self.correction_pcg_iterations
        return budget if self.ends_by_budget else max(budget, self.most_pcg_iterations)

    @property
    def searches_in_step(self) -> int:
        """How often the list of candidates is extended in a correction, at most."""
        return self.searches if self.ends_by_budget else max(self.searches, self.most_searches)

    def by_budget(self) -> Settings:
        """The same with corrections that do."""
        return replace(self, accuracy=None, deadline=None)


PRESETS: dict[str, Settings] = {
    "draft": Settings(
        largest_step=1 / 30,
        outer_iterations=2,
        correction_iterations=4,
        correction_nearness=0.03,
        correction_pcg_iterations=15,
        correction_torn=1.3,
        second_iterations=12,
        second_pcg_iterations=40,
        substep_travel=16e-3,
        searches=6,
        deflection_passes=8,
    ),
    "live": Settings(),
    "fit": replace(Settings(), largest_step=1 / 120, outer_iterations=8, correction_iterations=16),
    "reference": replace(
        Settings(),
        largest_step=1 / 120,
        outer_iterations=8,
        correction_iterations=50,
        correction_pcg_iterations=400,
        correction_pcg_tolerance=1e-3,
        contact_passes=20,
        searches=100,
    ),
}


def preset_of(settings: Settings) -> str:
    """The name of the preset that these are, whatever accuracy and deadline were bought besides; "" of none."""
    return next((name for name, preset in PRESETS.items() if preset == settings.by_budget()), "")
