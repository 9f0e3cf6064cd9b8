"""A small session's topology and states that move like one, for the tests of the protocol."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from tryon_protocol import EncodedFrame, FrameEncoder, Skinner, Topology
from tryon_protocol.vector_content import topology as golden_topology


@dataclass
class State:
    """What the simulation hands to the encoder: cloth (N,3), body (B,3), root (3,) in m, rotations (J,4)."""

    cloth: np.ndarray
    body: np.ndarray
    root: np.ndarray
    rotations: np.ndarray

    def encode(self, encoder: FrameEncoder, t: float) -> EncodedFrame:
        return encoder.encode(self.cloth, self.body, self.root, self.rotations, t_sim=t, t_published=t)


@pytest.fixture(scope="session")
def topology() -> Topology:
    return golden_topology()


@pytest.fixture(scope="session")
def make_state(topology: Topology) -> Callable[..., State]:
    """make_state(seed, place, yielding): a random pose, cloth within 2 m of place, some body vertices off the skin."""
    skinner = Skinner(topology.body)
    drape = np.random.default_rng(0).uniform(-0.8, 0.8, (topology.cloth_vertex_count, 3))

    def make(seed: int, place: tuple[float, float, float] = (0.0, 0.0, 0.0), yielding: int = 20) -> State:
        rng = np.random.default_rng(seed)
        rotations = rng.normal(size=(len(topology.body.joint_names), 4))
        rotations /= np.linalg.norm(rotations, axis=1, keepdims=True)
        root = np.array(place) + rng.uniform(-0.5, 0.5, 3)
        body = skinner.pose(root, rotations.astype(np.float32))
        moved = rng.choice(len(body), yielding, replace=False)
        body[moved] += rng.normal(0.0, 0.01, (yielding, 3))
        cloth = place + drape + rng.uniform(-0.1, 0.1, drape.shape)
        return State(cloth, body, root, rotations)

    return make
