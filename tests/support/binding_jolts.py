"""Iterations of the frames around the binding of each effect to a garment that is worn, and around its removal: those
of the penetration correction, of which a step takes as many as it needs.

    .venv/bin/python tests/support/binding_jolts.py [seconds of ramp ...]

Writes, of a bag over a capsule at preset `live`, for each effect and each length of its ramp: of three frames before it
is bound, of the ten after, and of the ten from when it is asked away, which begin with those in which it goes.
"""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

TESTS = Path(__file__).parents[1]
sys.path += [str(TESTS / "server"), str(TESTS / "server" / "support"), str(TESTS / "support")]

import patterns  # noqa: E402
from test_effect_binding import HEM, asked, hang  # noqa: E402

DT = 1 / 60  # s
FRAMES = 10
ASKED: dict[str, dict[str, Any]] = {
    "wind": {"velocity": [0.0, 0.0, 8.0], "shelter": 0.0},
    "pressure": {"pressure": 100.0},
    "elastic": {"lines": [{"along": HEM, "ratio": 0.6, "stiffness": 60.0}]},
    "creases": {"lines": [{"along": [{"panel": "front", "edge": 1}], "angle": 90.0}]},
    "fasteners": {"rows": [{"first": HEM[:1], "second": HEM[1:], "buttons": 3}]},
    "adhesion": {"kind": "wet_cling"},
}


def main(ramps: list[float]) -> None:
    with TemporaryDirectory() as folder:
        packed = hang(Path(folder), patterns.bag(60.0, 40.0), "live", 0.04).packed()
    for name, parameters in ASKED.items():
        for ramp in ramps:
            *_, drape = packed.unpacking()
            before = iterations(drape, 10)[-3:]
            for _ in drape.effects.rebind(asked(**{name: {**parameters, "ramp": ramp}})):
                pass
            after = iterations(drape, FRAMES)
            iterations(drape, 30)
            going = []
            while drape.effects.fade(asked()) > 0.0:
                going += iterations(drape, 1)
            for _ in drape.effects.rebind(asked()):
                pass
            gone = (going + iterations(drape, FRAMES))[:FRAMES]
            print(f"{name:10} ramp {ramp:4} s: before {before}, bound {after}, asked away {gone}", flush=True)


def iterations(drape: Any, frames: int) -> list[int]:
    """Of each of the next frames."""
    return [drape.advance(drape.pose, drape._time + DT).newton_iterations for _ in range(frames)]


if __name__ == "__main__":
    main([float(told) for told in sys.argv[1:]] or [0.0, 0.1])
