"""A body that comes as a sequence of meshes: its surface frame by frame, and the rigid parts it nearly consists of.

The frames are held as linear blend skinning of such parts plus what that leaves, in the rest frame of each vertex:

    v_b(t) = sum_j w_bj (R_j(t) (r_b + d_b(t) - c_j) + p_j(t)),

exact at the frames by the choice of d_b. Between two frames R turns by slerp, p follows a cubic through the frames
before and after (Catmull and Rom 1974), d goes straight: a swinging forearm keeps its length, where vertices on
straight lines would shorten it. The parts are what cloth is carried along with
(carry.py), as the joints of a posed body are. They are found by alternating between assigning vertices to the part that
explains their motion best and fitting the parts (Kabsch 1976), as smooth skinning decomposition begins (Le and Deng
2012); that only their motion matters, not that they are bones, is ours.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp
from scipy.spatial.transform import Rotation

from tryon_solver.body import quaternions
from tryon_solver.body.model import BodyError

if TYPE_CHECKING:
    from tryon_solver.body.on_device import MovingBody

PARTS = 32
FIT_FRAMES = 24  # over which parts are told apart, spread evenly
FIT_ROUNDS = 8
NEARNESS = 0.02  # of the distance to a part's middle counts as much as an error of motion: parts hang together
SMOOTHING_LENGTH = 0.03  # m, over which weights go from one part to the next
WEIGHTS = 4  # parts a vertex


@dataclass(frozen=True)
class Moment:
    """A sequence at `time` s, moved by `shift` (3,) m."""

    time: float
    shift: np.ndarray


@dataclass(frozen=True)
class MeshSequence:
    """T frames of a surface of B vertices and its J parts; part 0 is the whole, on which no vertex hangs."""

    faces: np.ndarray  # (F, 3) int32
    rest_vertices: np.ndarray  # (B, 3) float64 m, the first frame
    dt: float  # s, between frames
    skin_joints: np.ndarray  # (B, K) int32
    skin_weights: np.ndarray  # (B, K) float32, rows sum to 1
    centres: np.ndarray  # (J, 3) float64 m, middles of the parts at rest
    rotations: np.ndarray  # (T, J, 4) float64, unit quaternions x y z w from rest
    places: np.ndarray  # (T, J, 3) float64 m, where the middles are
    corrections: np.ndarray  # (T, B, 3) float32 m, d above
    dressed_at: float = 0.0  # s, of the frame in which a garment is put on

    @property
    def vertex_count(self) -> int:
        return len(self.rest_vertices)

    @property
    def frame_count(self) -> int:
        return len(self.rotations)

    @property
    def joint_count(self) -> int:
        return len(self.centres)

    @property
    def duration(self) -> float:
        """Time of the last frame [s]; the first is at 0."""
        return (self.frame_count - 1) * self.dt

    def sample(self, t: float, loop: bool = False) -> Moment:
        """The moment at t s; before the first and after the last frame the body stands still. A sequence is not looped:
        nothing says how its end leads to its beginning."""
        if loop and t > self.duration:
            raise BodyError(f"the sequence lasts {self.duration:.2f} s and has no motion for {t:.2f} s; ask for less")
        return Moment(float(np.clip(t, 0.0, self.duration)), np.zeros(3))

    def put(self, turn: np.ndarray, shift: np.ndarray) -> MeshSequence:
        """The same elsewhere: x goes to `turn` x + `shift`, a rotation (3, 3) and (3,) m, in every frame."""
        whole = Rotation.from_matrix(turn)
        flat = whole * Rotation.from_quat(self.rotations.reshape(-1, 4)) * whole.inv()
        return replace(
            self,
            rest_vertices=self.rest_vertices @ turn.T + shift,
            centres=self.centres @ turn.T + shift,
            rotations=quaternions.continuous(flat.as_quat().reshape(self.rotations.shape)),
            places=self.places @ turn.T + shift,
            corrections=(self.corrections @ turn.T).astype(np.float32),
        )

    def start(self) -> Moment:
        """The frame in which a garment is put on: the first, unless another was chosen (dressing/fitting_room.py)."""
        return Moment(self.dressed_at, np.zeros(3))

    def around(self, time: float) -> tuple[int, int, float]:
        """The frames before and after a time [s], and the share of the way between them."""
        place = np.clip(time / self.dt, 0.0, self.frame_count - 1)
        first = min(int(place), max(self.frame_count - 2, 0))
        return first, min(first + 1, self.frame_count - 1), float(place - first)

    def transforms(self, moment: Moment) -> np.ndarray:
        """(J, 4, 4) m: what each part does to points at rest."""
        a, b, share = self.around(moment.time)
        turns = quaternions.to_matrix(quaternions.slerp(self.rotations[a], self.rotations[b], share))
        places = self.places_at(moment)
        result = np.zeros((self.joint_count, 4, 4))
        result[:, :3, :3], result[:, 3, 3] = turns, 1.0
        result[:, :3, 3] = places - (turns @ self.centres[..., None])[..., 0]
        return result

    def places_at(self, moment: Moment) -> np.ndarray:
        """(J, 3) m: where the parts' middles are at the moment."""
        a, b, s = self.around(moment.time)
        p, q = self.places[a], self.places[b]
        before, after = self.places[max(a - 1, 0)], self.places[min(b + 1, self.frame_count - 1)]
        leaving, arriving = (q - before) / 2, (after - p) / 2
        if a == 0:
            leaving = q - p
        if b == self.frame_count - 1:
            arriving = q - p
        cubic = (2 * s**3 - 3 * s**2 + 1) * p + (3 * s**2 - 2 * s**3) * q
        return cubic + (s**3 - 2 * s**2 + s) * leaving + (s**3 - s**2) * arriving + moment.shift

    def corrected_rest(self, moment: Moment) -> np.ndarray:
        """(B, 3) float64 m: r + d at the moment."""
        a, b, share = self.around(moment.time)
        return self.rest_vertices + (1 - share) * self.corrections[a] + share * self.corrections[b]

    def surface(self, moment: Moment) -> np.ndarray:
        """(B, 3) float64 m: the vertices at the moment."""
        return blend(self.transforms(moment), self.skin_joints, self.skin_weights, self.corrected_rest(moment))

    def on_device(self, device: str) -> MovingBody[Moment]:
        """The body ready to be followed."""
        from tryon_solver.body.sequence_kernel import SequenceKernel

        return SequenceKernel(self, device)


def blend(transforms: np.ndarray, joints: np.ndarray, weights: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """(B, 3) m: linear blend skinning by `transforms` (J, 4, 4) of `rest` (B, 3) m."""
    matrices = np.einsum("bk,bkxy->bxy", weights.astype(np.float64), transforms[joints][:, :, :3])
    return np.einsum("bxy,by->bx", matrices[:, :, :3], rest) + matrices[:, :, 3]


def make_sequence(frames: np.ndarray, faces: np.ndarray, dt: float) -> MeshSequence:
    """Find the parts of a moving surface: `frames` (T, B, 3) m, `faces` (F, 3), `dt` s between frames.

    Raises BodyError when a value is not finite or the time between frames not positive.
    """
    if not np.isfinite(frames).all():
        frame = int(np.flatnonzero(~np.isfinite(frames).all(axis=(1, 2)))[0])
        raise BodyError(f"frame {frame} of the body has a position that is not a finite number; export it again")
    if not (np.isfinite(dt) and dt > 0):
        raise BodyError(f"the body's frames are {dt} s apart; the time between frames must be positive")
    rest = frames[0].astype(np.float64)
    label = _find_parts(frames, rest)
    weights = _smooth_weights(label, rest, faces)
    count = label.max() + 2
    centres = np.zeros((count, 3))
    rotations = np.zeros((len(frames), count, 4))
    places = np.zeros((len(frames), count, 3))
    for j in range(count):
        share = np.ones(len(rest)) if j == 0 else weights[:, j - 1]
        centres[j] = share @ rest / share.sum()
        turns, places[:, j] = fit_rigid(rest - centres[j], frames, share)
        rotations[:, j] = quaternions.continuous(turns[:, None])[:, 0]
    best = np.argsort(-weights, axis=1)[:, :WEIGHTS]
    chosen = np.take_along_axis(weights, best, axis=1)
    chosen = (chosen / chosen.sum(axis=1, keepdims=True)).astype(np.float32)
    joints = (best + 1).astype(np.int32)
    corrections = np.zeros(frames.shape, np.float32)
    for k in range(len(frames)):
        turns = quaternions.to_matrix(rotations[k])
        offset = places[k] - (turns @ centres[..., None])[..., 0]
        matrix = np.einsum("bk,bkxy->bxy", chosen.astype(np.float64), turns[joints])
        moved = frames[k] - np.einsum("bk,bkx->bx", chosen.astype(np.float64), offset[joints])
        corrections[k] = np.linalg.solve(matrix, moved[..., None])[..., 0] - rest
    return MeshSequence(
        faces.astype(np.int32), rest, dt, joints, chosen, centres, rotations, places, corrections
    )


def fit_rigid(rest: np.ndarray, frames: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rotations (T, 4) and places (T, 3) m of the origin that take `rest` (B, 3), centred, to each frame (T, B, 3).

    Least squares with `weights` (B,): W. Kabsch, "A solution for the best rotation to relate two sets of vectors" 1976.
    """
    covariance, middle = _covariance(rest, frames, weights)
    return _best_turns(covariance), middle


def _covariance(rest: np.ndarray, frames: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(T, 3, 3) of each frame (T, B, 3) with `rest` (B, 3), centred, by `weights` (B,), and its middle (T, 3)."""
    used = weights > 0
    w = weights[used] / weights[used].sum()
    moved = frames[:, used].astype(np.float64)
    middle = np.einsum("b,tbx->tx", w, moved)
    return np.einsum("b,tbx,by->txy", w, moved - middle[:, None], rest[used]), middle


def _best_turns(covariance: np.ndarray) -> np.ndarray:
    """Rotations (K, 4) that fit covariances (K, 3, 3) best."""
    u, _, vt = np.linalg.svd(covariance)
    u[..., 2] *= np.sign(np.linalg.det(u @ vt))[:, None]
    return Rotation.from_matrix(u @ vt).as_quat()


def _find_parts(frames: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """(B,) the part each vertex belongs to, 0 to J - 2."""
    chosen = np.unique(np.linspace(0, len(frames) - 1, FIT_FRAMES).round().astype(int))
    moved = frames[chosen].astype(np.float64)
    seeds = [int(np.argmax(np.linalg.norm(rest - rest.mean(axis=0), axis=1)))]
    distances = [np.linalg.norm(rest - rest[seeds[0]], axis=1)]
    nearest = distances[0]
    while len(seeds) < min(PARTS, len(rest) // 8 + 1):
        seeds.append(int(nearest.argmax()))
        distances.append(np.linalg.norm(rest - rest[seeds[-1]], axis=1))
        nearest = np.minimum(nearest, distances[-1])
    label = np.argmin(distances, axis=0)
    by_axis = np.moveaxis(moved, 2, 1).reshape(-1, len(rest))  # (3 T, B): what is summed up over frames lies in rows
    for _ in range(FIT_ROUNDS):
        label = np.unique(label, return_inverse=True)[1].ravel()
        count = label.max() + 1
        centres = np.empty((count, 3))
        covariances, places = np.empty((count, len(moved), 3, 3)), np.empty((count, len(moved), 3))
        for j in range(count):
            mine = (label == j).astype(np.float64)
            centres[j] = mine @ rest / mine.sum()
            covariances[j], places[j] = _covariance(rest - centres[j], moved, mine)
        turns = quaternions.to_matrix(_best_turns(covariances.reshape(-1, 3, 3))).reshape(count, -1, 3)
        cost = np.empty((count, len(rest)))
        for j in range(count):
            aside = rest - centres[j]
            off = turns[j] @ aside.T
            off += places[j].reshape(-1, 1)
            off -= by_axis
            error = np.sqrt(np.einsum("kb,kb->b", off, off) / len(moved))
            cost[j] = error + NEARNESS * np.linalg.norm(aside, axis=1)
        label = cost.argmin(axis=0)
    return np.unique(label, return_inverse=True)[1].ravel()


def _smooth_weights(label: np.ndarray, rest: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(B, J - 1) how much of each part a vertex is: the labels, spread over the surface."""
    weights = np.eye(label.max() + 1)[label]
    sides = np.vstack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    length = float(np.linalg.norm(rest[sides[:, 0]] - rest[sides[:, 1]], axis=1).mean())
    n = len(rest)
    both = np.vstack([sides, sides[:, ::-1]])
    links = sp.coo_matrix((np.ones(len(both)), (both[:, 0], both[:, 1])), shape=(n, n)).tocsr()
    links.data[:] = 1.0
    links = sp.diags(1.0 / (1.0 + np.asarray(links.sum(axis=1)).ravel())) @ (links + sp.identity(n))
    # a round spreads by about an edge; n rounds by sqrt(n) edges
    for _ in range(max(1, round((SMOOTHING_LENGTH / length) ** 2))):
        weights = links @ weights
    return weights
