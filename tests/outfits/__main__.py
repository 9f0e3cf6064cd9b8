"""What three garments over each other cost against one of them, and whether anything passes through anything.

    python tests/outfits --edge 0.0165 --motion walk --frames 60 --device cpu --preset draft

The demo's skirt, T-shirt and overshirt are put on one over the other, the T-shirt alone likewise, and both are led into
the motion. Every fifth frame IPC Toolkit says whether any two surfaces cross. Times are the median of a frame's wall
time, and of the processor's time of this process, which other programs of the machine have no share in.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

import warp as wp
from frame_judge import FrameJudge
from worn_garment import DEMO, demo_motion

from tryon_solver.body.model import default_body
from tryon_solver.body.motion import blend_in
from tryon_solver.dressing.dress import dress
from tryon_solver.dressing.outfit import Outfit, Worn, WornOutfit
from tryon_solver.dressing.put_over import put_over
from tryon_solver.geometry.panel_mesh import mesh_pattern
from tryon_solver.geometry.pattern import load_pattern
from tryon_solver.materials.fabric import FABRICS
from tryon_solver.settings import PRESETS

OUTFIT = {"skirt": "cotton_poplin", "tshirt": "cotton_jersey", "overshirt": "denim"}
ALONE = "tshirt"
JUDGED = 5  # of so many frames one


def put_on(names: list[str], edge: float, preset: str, device: str) -> WornOutfit:
    """These garments, one over the other."""
    meshes = {name: mesh_pattern(load_pattern(DEMO / "patterns" / f"{name}.json"), edge) for name in names}
    first, *others = names
    fabric = FABRICS[OUTFIT[first]]
    alone = dress(meshes[first], default_body(), fabric, PRESETS[preset], device)
    outfit = Outfit((Worn.of_pattern(first, alone.panels, alone.welded, fabric),))
    worn = WornOutfit(outfit, alone.simulation, alone.pose)
    for name in others:
        worn = put_over(worn, name, meshes[name], FABRICS[OUTFIT[name]])
    return worn


def played(worn: WornOutfit, motion: str, frames: int, fps: float) -> dict[str, float]:
    """Figures of so many frames of the motion, the first second of which leads into it."""
    sim = worn.simulation
    assert sim.scene.body is not None
    body = default_body()
    into = blend_in(worn.pose, demo_motion(motion, body), 1.0)
    judge = FrameJudge(sim.scene.garment.faces, body.faces, sim.cloth_positions(), sim.body_positions())
    begun, wall, own = sim.state.time, [], []
    crossed = judged = retries = 0
    gap = np.inf
    for k in range(1, frames + 1):
        clock, cpu = time.perf_counter(), time.process_time()
        report = sim.advance(into.sample(k / fps), begun + k / fps)
        wall.append(time.perf_counter() - clock)
        own.append(time.process_time() - cpu)
        retries, gap = retries + report.retries, min(gap, report.min_gap)
        if k % JUDGED == 0:
            judged += 1
            crossed += not judge.judge(sim.cloth_positions(), sim.body_positions()).clean
    return {
        "vertices": sim.cloth_count,
        "ms": 1e3 * float(np.median(wall)),
        "cpu ms": 1e3 * float(np.median(own)),
        "void steps": retries,
        "crossed": crossed,
        "judged": judged,
        "least gap mm": 1e3 * gap,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--edge", type=float, default=0.0165, help="m, of the meshes (%(default)s)")
    parser.add_argument("--motion", default="walk", help="%(default)s")
    parser.add_argument("--frames", type=int, default=60, help="%(default)s")
    parser.add_argument("--fps", type=float, default=30.0, help="%(default)s")
    parser.add_argument("--preset", default="draft", choices=list(PRESETS), help="%(default)s")
    parser.add_argument("--device", default="cpu", help="%(default)s")
    asked = parser.parse_args()
    wp.config.quiet = True
    found = {}
    for names in ([ALONE], list(OUTFIT)):
        worn = put_on(names, asked.edge, asked.preset, asked.device)
        counts = [layer.vertices.stop - layer.vertices.start for layer in worn.outfit.layers]
        found[len(names)] = played(worn, asked.motion, asked.frames, asked.fps)
        figures = ", ".join(f"{name} {value:.3g}" for name, value in found[len(names)].items())
        print(f"{' + '.join(names)} {counts}, {asked.motion}: {figures}", flush=True)
    one, three = found[1], found[len(OUTFIT)]
    clock, cpu = (three[name] / one[name] for name in ("ms", "cpu ms"))
    print(f"three over one: {clock:.2f} by the clock, {cpu:.2f} by the processor's time")


if __name__ == "__main__":
    main()
