"""The constant matrices of a step in the forms in which it multiplies by them, all over one pattern.

Where each entry goes is found once. When the garment gets another shape the matrices they are made of have other
entries, and `fill` writes them over the old ones: what works with the forms, recorded graphs among it, need not know.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import warp as wp

from tryon_solver.linalg.block_ell import BlockRows
from tryon_solver.linalg.device_matrix import DeviceMatrix, Summand, add_together, union
from tryon_solver.linalg.ell import EllMatrix, entry_places
from tryon_solver.linalg.near_far import NearFar, Places, take

if TYPE_CHECKING:
    from tryon_solver.linalg.live_entries import LiveEntries


@dataclass(frozen=True)
class Term:
    """`scale` times a matrix (N, N). `exact`: it is the Hessian of what it stands for; `rate`: of a force proportional
    to velocity [N s/m], which is none of the stiffness; `live`: its entries may be others in every step."""

    matrix: DeviceMatrix
    scale: float = 1.0
    exact: bool = False
    rate: bool = False
    live: bool = False


class ConstantMatrices:
    """Of the terms' sums over `count` vertices, with the blocks of `rows`.

    `total` is the stiffness [N/m], `rows` it in float32 rows and `diagonal` (N,) float32 its diagonal; `near_far` the
    correction's: what is exact, with the rates over the time step.
    """

    def __init__(self, terms: Sequence[Term], rows: BlockRows, count: int, device: str) -> None:
        pattern = union([term.matrix.pattern for term in terms], count)
        summands = [(term, Summand.over(pattern, term.matrix, term.scale)) for term in terms]
        self._all = [summand for term, summand in summands if not term.rate]
        self._exact = [summand for term, summand in summands if term.exact]
        self._rates = [summand for term, summand in summands if term.rate]
        self.total = DeviceMatrix(pattern, wp.zeros(pattern.nnz, dtype=wp.float64, device=device))
        self._scratch = wp.zeros_like(self.total.values)
        columns, places = entry_places(pattern)
        self.rows = EllMatrix.of_columns(columns, device)
        self._places: wp.array = wp.array(places, dtype=wp.int32, device=device)
        on_diagonal = np.where(columns == np.arange(count)[:, None], places, -1).max(axis=1)
        self._on_diagonal: wp.array = wp.array(on_diagonal[:, None], dtype=wp.int32, device=device)
        self.diagonal = wp.zeros(count, dtype=wp.float32, device=device)
        self._split = Places.of(pattern, rows)
        self._at_rest = self._split.zeros()
        self._rate = self._split.zeros() if self._rates else None
        self.near_far: NearFar = self._at_rest if self._rate is None else self._split.zeros()
        self._per_dt = wp.zeros(1, dtype=wp.float32, device=device)
        self.live = self._follow([(term, summand) for term, summand in summands if term.live])
        self.fill()

    def fill(self) -> None:
        """Take up the terms' entries as they are now; `set_time_step` comes next."""
        if self._rate is not None:
            add_together(self._rates, self._scratch)
            self._split.take(self._scratch, self._rate)
        add_together(self._exact, self._scratch)  # comes last: what is live goes on with it
        self._split.take(self._scratch, self._at_rest)
        add_together(self._all, self.total.values)
        take(self.total.values, self._places, self.rows.weights)
        take(self.total.values, self._on_diagonal, self.diagonal.reshape((-1, 1)))
        if self.live is not None:
            self.live.begin()

    def set_time_step(self, dt: float) -> None:
        """Let `near_far` be that of steps of dt [s]."""
        self._per_dt.fill_(1.0 / dt)
        if self._rate is not None:
            from tryon_solver.linalg.rated import add_rated  # not compiled for who has none

            add_rated(self._at_rest, self._per_dt, self._rate, self.near_far)

    def _follow(self, live: list[tuple[Term, Summand]]) -> LiveEntries | None:
        """What takes up the entries of terms that may be others in every step; None where there are none."""
        if not live:
            return None
        from tryon_solver.linalg.live_entries import Form, LiveEntries, LiveSum  # not compiled for who has none

        summands = [summand for _, summand in live]
        whole = LiveSum(self.total.values, summands, [Form(self._places, self.rows.weights)])
        whole.forms.append(Form(self._on_diagonal, self.diagonal))
        at_rest, shown = self._at_rest, self.near_far
        exact = LiveSum(self._scratch, [summand for term, summand in live if term.exact])
        for name, places in (("near", self._split.near), ("far", self._split.far)):
            one, other = (values_of(part, name) for part in (at_rest, shown))
            rate = None if self._rate is None else values_of(self._rate, name)
            exact.forms.append(Form(places, one))
            if rate is not None:
                exact.forms.append(Form(places, other, rate))
        return LiveEntries([whole, exact], self._per_dt)


def values_of(part: NearFar, name: str) -> wp.array:
    """The weights of the near or the far part."""
    return part.near if name == "near" else part.far.weights
