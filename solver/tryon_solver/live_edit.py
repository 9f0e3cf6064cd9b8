"""A drag of a pattern's edge while the garment is worn: its shape follows the newest edit, and the cloth the shape.

Between two frames the pattern coordinates move on their way to what was wanted last (redesign/ramp.py), and the worn
garment takes them up (reshape.py). However many edits come between two frames, only the newest counts. The inverse of
the reduced matrix is made on a thread beside the simulation, once the shape stands, and now and then on a long way:
what is ready is taken up before the next frame. A new cut that had to be drawn out to be put on begins with slack
(redesign/slack.py), which is taken in on the way, too.
"""

from __future__ import annotations

import math
from concurrent.futures import Future
from dataclasses import replace

import numpy as np

from tryon_solver.geometry.garment import Garment, Layer
from tryon_solver.geometry.panel_mesh import PanelMesh
from tryon_solver.geometry.pattern import Pattern
from tryon_solver.redesign.drag import Drag
from tryon_solver.redesign.ramp import Ramp, begin_ramp
from tryon_solver.redesign.remesh import Remesh
from tryon_solver.redesign.slack import Slack
from tryon_solver.reshape import reshape
from tryon_solver.simulation import BESIDE, Simulation

RAMP_SECONDS = 0.1  # simulated, in which the rest shape goes from where it is to what is wanted, at least:
FASTEST = 1.0  # m/s that a point of the pattern goes at most, by which cloth would be thrown
FASTEST_STRAIN = 1.0  # 1/s, at which a side of a triangle becomes longer or shorter at most, by its logarithm
STEP_SECONDS = 0.03  # simulated, for which it stands on that way at least: of 20,000 vertices a host takes as long to
# take up a shape as a GPU takes for a frame, and frames that come faster would come late for it
INVERSE_SECONDS = 1.0  # simulated, between inverses of shapes on the way: made one after the other, the thread that
# makes them slows the simulation beside it to half its rate, and an old one costs the search little


class LiveEdit:
    """The drag `drag` of a garment that `sim` simulates in `size` times the pattern's own, as `layer` of an outfit.

    Whoever drives the simulation calls `before_frame` before each `advance`. `now` is the mesh as it is worn, in the
    pattern's own size; `wanted` what it is on its way to, or where it is.
    """

    def __init__(self, sim: Simulation, drag: Drag, size: float = 1.0, layer: Layer | None = None) -> None:
        self.sim, self.drag, self.size = sim, drag, size
        self._own = slice(None) if layer is None else layer.faces
        self.now: PanelMesh = drag.mesh
        self.wanted: PanelMesh = drag.mesh
        self.ramp_seconds = 0.0  # simulated, that the way to what is wanted takes or took
        self._ramp: Ramp | None = None
        self._begun = 0.0  # s, when the shape set out
        self._slack: Slack | None = None
        self._slack_begun = self._slack_seconds = self._taken_in = 0.0  # s, s, and the share of it that is taken in
        self._stood_since = -math.inf  # s, when it became `now`
        self._making: tuple[Garment, int, Future[np.ndarray]] | None = None
        self._inverse_at = sim.state.time  # when the shape last had its own inverse, or one was begun
        self._at_start = dict(sim.inverses)
        self._first = self._given = sim.scene.garment  # what is simulated, as this edit gave it its shape
        sim.inverses_beside = True

    def want(self, pattern: Pattern) -> Remesh | None:
        """Let the garment become this pattern, from the next frame on; Remesh, and nothing changes, where it can't in
        the mesh that it has."""
        return self.want_mesh(self.drag.moved(pattern))

    def want_mesh(self, mesh: PanelMesh | Remesh) -> Remesh | None:
        """`want` of a pattern for which this is `drag.moved`."""
        if isinstance(mesh, Remesh):
            return mesh
        ramp = begin_ramp(self.now, mesh)
        if isinstance(ramp, Remesh):
            return ramp
        now = self.sim.state.time
        self._begun = now if self._ramp is None else max(self._begun, self._stood_since)
        self.wanted, self._ramp = mesh, ramp
        way, strain = self.size * ramp.longest_way(), ramp.largest_strain
        self.ramp_seconds = max(RAMP_SECONDS, way / FASTEST, strain / FASTEST_STRAIN)
        return None

    def begin_with(self, slack: Slack) -> None:
        """Have this slack from the next frame on, and take it in."""
        self._slack, self._slack_begun = slack, self.sim.state.time
        self._slack_seconds = self.ramp_seconds = max(RAMP_SECONDS, slack.largest_strain() / FASTEST_STRAIN)

    def go_on_in(self, sim: Simulation) -> None:
        """The garment, in the shape of `now`, is simulated by another simulation from here on, under other effects.
        What was made for the matrices of the one before serves no longer."""
        self.sim = sim
        sim.inverses_beside = True
        if self._making is not None:
            self._making[2].cancel()
        self._making = None
        self._at_start.clear()

    @property
    def there(self) -> bool:
        """Is the shape what is wanted?"""
        return self._ramp is None and self._slack is None

    @property
    def settled(self) -> bool:
        """Is the shape what is wanted, and the inverse that of the shape?"""
        return self.there and self._has_inverse

    @property
    def _has_inverse(self) -> bool:
        """Is there an inverse of shape and steps as they are?"""
        return self.sim.factor_key in self.sim.inverses

    def before_frame(self, time: float) -> None:
        """Let the shape be what it should be at the frame's time [s], and take up an inverse that is ready."""
        if not self.there and (time - self._stood_since >= STEP_SECONDS or self._due(time)):
            self._go_on_the_way(time)
        self._go_on_with_inverse(time)

    def _due(self, time: float) -> bool:
        """Is the end of a way reached?"""
        on_ramp = self._ramp is not None and time - self._begun >= self.ramp_seconds
        return on_ramp or (self._slack is not None and time - self._slack_begun >= self._slack_seconds)

    def _go_on_the_way(self, time: float) -> None:
        self._stood_since = time
        if self._ramp is not None:
            share = (time - self._begun) / self.ramp_seconds
            there = share >= 1.0
            self.now, self._ramp = (self.wanted, None) if there else (self._ramp.at(share), self._ramp)
        if self._slack is not None:
            self._taken_in = (time - self._slack_begun) / self._slack_seconds
            self._slack = None if self._taken_in >= 1.0 else self._slack
        self._reshape()

    def _reshape(self) -> None:
        garment = self.garment()
        reshape(self.sim, garment)
        self._given = garment

    def taken_back(self, garment: Garment) -> Garment:
        """What is worn, or another shape of it, with this garment's part of it as it was when the drag began."""
        return self._with_own(garment, self._first.uv_corners[self._own])

    def garment(self) -> Garment:
        """What is worn, in the shape of `now`. At the start's it has the corners of then: brought to the pattern's own
        size and back, they would have other bits."""
        worn = self.sim.scene.garment
        if not np.array_equal(self.now.uv, self.drag.mesh.uv):
            corners = np.take(self.size * self.now.uv, self.now.faces, axis=0)  # a tenth of what indexing takes
        elif self._slack is None:
            return self.taken_back(worn)
        else:
            corners = self._first.uv_corners[self._own]
        return self._with_own(worn, corners if self._slack is None else self._slack.given(corners, self._taken_in))

    def _with_own(self, garment: Garment, corners: np.ndarray) -> Garment:
        """The garment with these `corners` (K, 3, 2) m in this one's part of it."""
        if self._own == slice(None):
            return replace(garment, uv_corners=corners)
        every = garment.uv_corners.copy()
        every[self._own] = corners
        return replace(garment, uv_corners=every)

    def arrive(self) -> None:
        """Have the shape that is wanted at once; its inverse is made beside the simulation."""
        if not self.there:
            self.now, self._ramp, self._slack = self.wanted, None, None
            self._reshape()

    def finish(self) -> None:
        """Be what is wanted at once, with its inverse: at the end of a session, or where runs must be alike."""
        self.arrive()
        if self._making is not None:
            self._making[2].cancel()
            self._making = None
        if not self._has_inverse and not self._back_at_start():
            self.sim.use_inverse(self.sim.reduced_inverse())

    def _go_on_with_inverse(self, time: float) -> None:
        """Steps of every half octave have an inverse of their own. Where one is not there yet the search makes do with
        another's: its first direction is poorer, and a frame that waited would come late."""
        sim = self.sim
        if self._making is not None and self._making[2].done():
            garment, key, made = self._making
            self._making = None
            own = garment is sim.scene.garment
            if key == sim.factor_key:
                (sim.use_inverse if own else sim.make_do_with)(made.result())
            elif own:
                sim.inverses[key] = made.result()
        if self._has_inverse:
            self._inverse_at = time
            return
        due = self.there or time - self._inverse_at >= INVERSE_SECONDS
        theirs = self._given is not sim.scene.garment  # an edit of another garment has given it one since
        if self._making is None and due and not theirs and not self._back_at_start():
            self._inverse_at = time
            self._making = self._given, sim.factor_key, BESIDE.submit(sim.inverse_to_make())

    def _back_at_start(self) -> bool:
        """Is it, and with an inverse of then? These are kept: made again, its last bits would depend on where in memory
        it is made."""
        sim = self.sim
        back = np.array_equal(sim.scene.garment.uv_corners, self._first.uv_corners)
        if not back or sim.factor_key not in self._at_start:
            return False
        sim.inverses.update(self._at_start)
        sim.use_inverse(self._at_start[sim.factor_key])
        return True
