"""The bench's judge, in a process of its own, finds a simulation's frame clean or not, and leaves nothing here."""

import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "solver" / "bench"))

from judge_apart import judge_apart  # noqa: E402

BODY = trimesh.creation.icosphere(subdivisions=2, radius=0.1)
CLOTH = trimesh.creation.icosphere(subdivisions=2, radius=0.11)


class Worn:
    """A ball of cloth about a ball, as far as a judge asks a simulation."""

    def __init__(self):
        shapes = SimpleNamespace(faces=CLOTH.faces), SimpleNamespace(faces=BODY.faces)
        self.scene = SimpleNamespace(garment=shapes[0], body=shapes[1])
        self.cloth = np.array(CLOTH.vertices, np.float32)

    def cloth_positions(self):
        return self.cloth

    def body_positions(self):
        return np.array(BODY.vertices, np.float32)


def through_the_body(cloth):
    cloth[0] *= 0.5


def within_the_body(cloth):
    cloth *= 0.5


def through_itself(cloth):
    near = np.argsort(np.linalg.norm(cloth - cloth[0], axis=1))
    cloth[0] = 1.05 * cloth[near[10]]  # beyond its neighbours' triangles, which its own cut; far from the body


def not_a_number(cloth):
    cloth[7, 1] = np.nan


def test_present_frames_are_judged_as_they_come():
    worn = Worn()
    with judge_apart(worn) as is_clean:
        assert is_clean()
        for harm in (through_the_body, within_the_body, through_itself, not_a_number):
            worn.cloth = np.array(CLOTH.vertices, np.float32)
            harm(worn.cloth)
            assert not is_clean(), harm.__name__
        worn.cloth = np.array(CLOTH.vertices, np.float32)
        assert is_clean()


def test_a_judge_that_dies_is_told_of():
    worn = Worn()
    worn.cloth = worn.cloth[:-1]  # fewer than there are in the faces: IPC Toolkit is not ready for that
    with judge_apart(worn) as is_clean, pytest.raises(Exception, match=r"terminated|index|out of bounds"):
        is_clean()
