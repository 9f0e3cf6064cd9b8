"""What is measured on every decoded frame. Nothing here asks the solver."""

from __future__ import annotations

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
    stretch_most: float  # the smallest value that 99.9 % of the triangles' larger principal stretches don't exceed
    stretch_max: float
    worn: bool  # every loop runs around the limbs that it ran around in the first frame
    slid: float  # farthest any loop but the lowest has slid along the bones since the first frame; inf when off
    hem: np.ndarray  # (L, 3) vertices of the lowest loop, relative to the pelvis and in its frame


class FrameMeter:
    """Prepared for one topology; the first frame it is shown is the garment as it was dressed."""

    def __init__(self, topology: Topology, dressed: DecodedFrame, closest: float) -> None:
        """`closest` [m]: facing skin nearer than this pinches cloth between (`PinchedSkin.reach`)."""
        assert topology.uv is not None, "a garment without pattern coordinates has no rest shape"
        self.faces = topology.faces.astype(np.int32)
        self.uv = topology.uv.astype(np.float64)
        self.skinner = Skinner(topology.body)
        body_faces = topology.body.faces.astype(np.int32)
        self.judge = FrameJudge(self.faces, body_faces, dressed.cloth, dressed.body)
        self.pinch = PinchedSkin(topology.body.rest_vertices.astype(np.float64), body_faces, closest)
        loops = boundary_loops(self.faces)
        body = topology.body
        self.loops = LoopsOnLimbs(loops, body.joint_names, body.parents, body.rest_joints.astype(np.float64))
        self.lowest = int(np.argmin([dressed.cloth[loop, 1].mean() for loop in loops]))
        self.passes, self.places = self.loops.crossings(dressed.cloth, self.joints(dressed)[1])

    def joints(self, frame: DecodedFrame) -> tuple[np.ndarray, np.ndarray]:
        """The pelvis's rotation (3, 3) and the joints' places (J, 3) m."""
        turned, centres = self.skinner.joint_transforms(frame.rotations)
        return turned[0], centres + frame.root

    def measure(self, frame: DecodedFrame, intersections: bool) -> FrameFigures:
        """Everything about one frame; `intersections` says whether IPC Toolkit is asked."""
        cloth, body = frame.cloth, frame.body
        skin = self.skinner.pose(frame.root, frame.rotations)
        lag = np.linalg.norm(body - skin, axis=1)
        pinched = self.pinch.pinched(skin) if lag.max() > LAG_UNQUESTIONED else np.zeros(len(lag), bool)
        larger = principal_stretches(cloth, self.faces, self.uv)[:, 1]
        pelvis, joints = self.joints(frame)
        passes, places = self.loops.crossings(cloth, joints)
        slid = [self.loops.slide(before, now) for before, now in zip(self.places, places)]
        return FrameFigures(
            verdict=self.judge.judge(cloth, body) if intersections else None,
            finite=bool(np.isfinite(cloth).all() and np.isfinite(body).all()),
            lag_p95=float(np.percentile(lag[~pinched], 95)),
            lag_max=float(lag[~pinched].max()),
            pinched_lag_max=float(lag[pinched].max(initial=0.0)),
            pinched_area=self.pinch.area(skin, pinched),
            stretch_most=float(np.quantile(larger, 0.999, method="inverted_cdf")),
            stretch_max=float(larger.max()),
            worn=bool((passes == self.passes).all()),
            slid=max((s for k, s in enumerate(slid) if k != self.lowest), default=0.0),
            hem=(cloth[self.loops.loops[self.lowest]] - joints[0]) @ pelvis,
        )
