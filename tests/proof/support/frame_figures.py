"""What is measured on every frame, decoded or recorded. Nothing here asks the solver."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from frame_judge import FrameJudge, FrameVerdict, principal_stretches
from loops_on_limbs import LoopsOnLimbs
from pinched_skin import PinchedSkin

from tryon_protocol import DecodedFrame, Skinner, Topology
from tryon_solver.geometry.boundary_loops import boundary_loops

LAG_UNQUESTIONED = 3e-3  # m: no limit is finer, so that nothing has to be excused as pinched when no vertex lags more


@dataclass(frozen=True)
class FrameFigures:
    """Lengths in m, areas in m^2."""

    verdict: FrameVerdict | None  # by IPC Toolkit; None when this frame was left out
    finite: bool
    lag_p95: float  # skin to surface at the frame's own pose, unpinched vertices
    lag_max: float
    pinched_lag_max: float
    pinched_area: float  # 0 where no vertex lags enough to ask
    skin_depth: float  # how deep skin lies in another part's; 0 where pinched skin lags too little to ask
    stretch_most: float  # the smallest value that 99.9 % of the triangles' larger principal stretches don't exceed
    stretch_max: float
    worn: bool  # every loop that ran around limbs in the first frame runs around the same ones
    slid: float  # farthest any loop but the lowest has slid along the bones since the first frame; inf when off
    hem: np.ndarray  # (L, 3) vertices of the lowest loop, relative to the pelvis and in its frame


@dataclass(frozen=True)
class Stance:
    """The body at a frame's own pose time."""

    skin: np.ndarray  # (B, 3) m, as tracked
    pelvis: np.ndarray  # (3, 3) rotation
    joints: np.ndarray  # (J, 3) m


@dataclass(frozen=True)
class Bones:
    """The joints inside a body."""

    names: Sequence[str]
    parents: np.ndarray  # (J,)
    at_rest: np.ndarray  # (J, 3) m


class StateMeter:
    """Prepared for one garment on one body; what it is made with is the garment as it was dressed."""

    def __init__(
        self,
        faces: np.ndarray,
        uv: np.ndarray,
        body_rest: np.ndarray,
        body_faces: np.ndarray,
        bones: Bones,
        cloth: np.ndarray,
        stance: Stance,
        closest: float,
    ) -> None:
        """`faces` (F, 3) with their rest shape `uv` (F, 3, 2) m; `cloth` (N, 3) m on the body in `stance`.

        `closest` [m]: facing skin nearer than this pinches cloth between (`PinchedSkin.reach`).
        """
        self.faces, self.uv = faces.astype(np.int32), uv.astype(np.float64)
        self.judge = FrameJudge(self.faces, body_faces, cloth, stance.skin)
        self.pinch = PinchedSkin(body_rest.astype(np.float64), body_faces.astype(np.int32), closest)
        loops = boundary_loops(self.faces)
        self.loops = LoopsOnLimbs(loops, bones.names, bones.parents, bones.at_rest.astype(np.float64))
        self.lowest = int(np.argmin([cloth[loop, 1].mean() for loop in loops]))
        self.passes, self.places = self.loops.crossings(cloth, stance.joints)
        self.on_limbs = self.passes.any(axis=1)  # not the edge of a hood around the face, say

    def measure(self, cloth: np.ndarray, body: np.ndarray, stance: Stance, intersections: bool) -> FrameFigures:
        """Everything about cloth (N, 3) m and surface (B, 3) m; `intersections`: whether IPC Toolkit is asked."""
        skin, joints = stance.skin, stance.joints
        lag = np.linalg.norm(body - skin, axis=1)
        pinched = self.pinch.pinched(skin) if lag.max() > LAG_UNQUESTIONED else np.zeros(len(lag), bool)
        larger = principal_stretches(cloth, self.faces, self.uv)[:, 1]
        passes, places = self.loops.crossings(cloth, joints)
        slid = [self.loops.slide(before, now) for before, now in zip(self.places, places)]
        return FrameFigures(
            verdict=self.judge.judge(cloth, body) if intersections else None,
            finite=bool(np.isfinite(cloth).all() and np.isfinite(body).all()),
            lag_p95=float(np.percentile(lag[~pinched], 95)),
            lag_max=float(lag[~pinched].max()),
            pinched_lag_max=float(lag[pinched].max(initial=0.0)),
            pinched_area=self.pinch.area(skin, pinched),
            skin_depth=self.pinch.depth(skin) if lag[pinched].max(initial=0.0) > LAG_UNQUESTIONED else 0.0,
            stretch_most=float(np.quantile(larger, 0.999, method="inverted_cdf")),
            stretch_max=float(larger.max()),
            worn=bool(self.on_limbs.any() and (passes == self.passes)[self.on_limbs].all()),
            slid=max((s for k, s in enumerate(slid) if k != self.lowest), default=0.0),
            hem=(cloth[self.loops.loops[self.lowest]] - joints[0]) @ stance.pelvis,
        )


class FrameMeter:
    """Of decoded frames, prepared for one topology; the first one is the garment as it was dressed."""

    def __init__(self, topology: Topology, dressed: DecodedFrame, closest: float) -> None:
        """`closest` as in StateMeter."""
        assert topology.uv is not None, "a garment without pattern coordinates has no rest shape"
        body = topology.body
        self.skinner = Skinner(body)
        self.state = StateMeter(
            topology.faces,
            topology.uv,
            body.rest_vertices,
            body.faces.astype(np.int32),
            Bones(body.joint_names, body.parents, body.rest_joints),
            dressed.cloth,
            self.stance(dressed),
            closest,
        )

    def stance(self, frame: DecodedFrame) -> Stance:
        """The body in the frame's own pose."""
        turned, centres = self.skinner.joint_transforms(frame.rotations)
        return Stance(self.skinner.pose(frame.root, frame.rotations), turned[0], centres + frame.root)

    def measure(self, frame: DecodedFrame, intersections: bool) -> FrameFigures:
        """Everything about one frame; `intersections` says whether IPC Toolkit is asked."""
        return self.state.measure(frame.cloth, frame.body, self.stance(frame), intersections)
