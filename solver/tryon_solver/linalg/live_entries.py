"""Entries of the constant matrices that may be others in every step, as those of a button that is opened.

Of the sums that a step multiplies by, only the entries that such terms have are made anew, on the device, and put where
each form of the sum keeps them: some tens of numbers, whatever the mesh.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import warp as wp

from tryon_solver.linalg.device_matrix import Summand, add_together
from tryon_solver.linalg.launch import launch

wp.set_module_options({"enable_backward": False})


@dataclass(frozen=True)
class Form:
    """A form of a sum: `places`, of any shape, int32: which entry each of `out`'s float32 values is, -1 for none; and
    beside it stands `rate` over the time step, if there is one, a form of the same places."""

    places: wp.array
    out: wp.array
    rate: wp.array | None = None


@dataclass(frozen=True)
class LiveSum:
    """A sum's entries `values` (nnz,) float64, the live ones among its summands, and its forms."""

    values: wp.array
    summands: Sequence[Summand]
    forms: list[Form] = field(default_factory=list)


class LiveEntries:
    """Of several sums over one pattern; `per_dt` (1,) float32 1/s is one over the time step."""

    def __init__(self, sums: Sequence[LiveSum], per_dt: wp.array) -> None:
        self._followed = [_Followed(one, per_dt) for one in sums if one.summands]

    def begin(self) -> None:
        """The sums have been made whole, of the live summands as they are now."""
        for one in self._followed:
            one.begin()

    def take_up(self) -> None:
        """Let the sums' forms have the live summands as they are now. Neither reads nor allocates."""
        for one in self._followed:
            one.take_up()


class _Followed:
    """One sum: `entries` (E,) int32 of it may change; `others` (E,) float64 is what else is in them."""

    def __init__(self, of: LiveSum, per_dt: wp.array) -> None:
        self._sum, self._per_dt = of, per_dt
        device = of.values.device
        places = [summand.places.numpy() for summand in of.summands]
        entries = np.unique(np.concatenate(places))
        self._entries: wp.array = wp.array(entries, dtype=wp.int32, device=device)
        self._others = wp.zeros(len(entries), dtype=wp.float64, device=device)
        self._own = wp.zeros(len(entries), dtype=wp.float64, device=device)
        self._summands = [
            Summand(
                summand.matrix,
                summand.scale,
                wp.array(np.searchsorted(entries, there), dtype=wp.int32, device=device),
            )
            for summand, there in zip(of.summands, places)
        ]
        self._slots: list[wp.array] = []
        for form in of.forms:
            slots = np.flatnonzero(np.isin(form.places.numpy().ravel(), entries))
            self._slots.append(wp.array(slots, dtype=wp.int32, device=device))

    def begin(self) -> None:
        add_together(self._summands, self._own)
        inputs = [self._entries, self._sum.values, self._own]
        launch(set_apart_kernel, len(self._entries), inputs, [self._others], device=self._own.device)

    def take_up(self) -> None:
        device = self._own.device
        add_together(self._summands, self._own)
        inputs = [self._entries, self._others, self._own]
        launch(put_kernel, len(self._entries), inputs, [self._sum.values], device=device)
        for form, slots in zip(self._sum.forms, self._slots):
            out = form.out.flatten()
            inputs = [slots, form.places.flatten(), self._sum.values]
            launch(show_kernel, len(slots), inputs, [out], device=device)
            if form.rate is not None:
                rates = [slots, form.rate.flatten(), self._per_dt]
                launch(add_rate_kernel, len(slots), rates, [out], device=device)


@wp.kernel
def set_apart_kernel(
    entries: wp.array(dtype=wp.int32),
    values: wp.array(dtype=wp.float64),
    own: wp.array(dtype=wp.float64),
    others_out: wp.array(dtype=wp.float64),
):
    k = wp.tid()
    others_out[k] = values[entries[k]] - own[k]


@wp.kernel
def put_kernel(
    entries: wp.array(dtype=wp.int32),
    others: wp.array(dtype=wp.float64),
    own: wp.array(dtype=wp.float64),
    values_out: wp.array(dtype=wp.float64),
):
    k = wp.tid()
    values_out[entries[k]] = others[k] + own[k]


@wp.kernel
def show_kernel(
    slots: wp.array(dtype=wp.int32),
    places: wp.array(dtype=wp.int32),
    values: wp.array(dtype=wp.float64),
    out: wp.array(dtype=wp.float32),
):
    k = slots[wp.tid()]
    out[k] = wp.float32(values[places[k]])


@wp.kernel
def add_rate_kernel(
    slots: wp.array(dtype=wp.int32),
    rate: wp.array(dtype=wp.float32),
    per_dt: wp.array(dtype=wp.float32),
    out: wp.array(dtype=wp.float32),
):
    k = slots[wp.tid()]
    out[k] = out[k] + per_dt[0] * rate[k]
