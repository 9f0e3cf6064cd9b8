"""Time of a published frame on this machine, with its stages: a demo garment on a demo motion.

    python solver/bench/frame.py --garment tshirt --motion walk --vertices 10000 --preset live --device cuda:0

Prints one table; times are wall times of `Simulation.advance` with the device synchronised, medians and 95th
percentiles over the frames after the blend into the motion.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

import numpy as np
import warp as wp

from tryon_solver import PRESETS, dress
from tryon_solver.body.bvh import parse_bvh
from tryon_solver.body.model import default_body
from tryon_solver.body.motion import blend_in
from tryon_solver.body.retarget import retarget
from tryon_solver.geometry.pattern import load_pattern
from tryon_solver.geometry.size import mesh_with_vertices
from tryon_solver.materials.fabric import FABRICS

DEMO = Path(__file__).resolve().parents[2] / "server" / "tryon_server" / "demo"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--garment", default="tshirt")
    parser.add_argument("--motion", default="walk")
    parser.add_argument("--fabric", default="cotton_jersey")
    parser.add_argument("--vertices", type=int, default=2500)
    parser.add_argument("--preset", default="draft", choices=PRESETS)
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--fps", type=float, default=60.0)
    parser.add_argument("--seconds", type=float, default=3.0)
    parser.add_argument("--record", type=Path, help="write decoded-size frames to this .npz for the judge")
    options = parser.parse_args()

    body = default_body()
    panels = mesh_with_vertices(load_pattern(DEMO / "patterns" / f"{options.garment}.json"), options.vertices)
    begun = time.perf_counter()
    dressed = dress(panels, body, FABRICS[options.fabric], PRESETS[options.preset], options.device)
    wp.synchronize()
    dressing = time.perf_counter() - begun
    simulation = dressed.simulation
    motion = retarget(parse_bvh((DEMO / "motions" / f"{options.motion}.bvh").read_text()), body)
    lead = blend_in(dressed.pose, motion, 1.0)
    start = simulation.state.time
    times, stages, reports, cloth, surface = [], {}, [], [], []
    for k in range(round((lead.duration + options.seconds) * options.fps)):
        t = (k + 1) / options.fps
        pose = lead.sample(t) if t < lead.duration else motion.sample(t - lead.duration, loop=True)
        begun = time.perf_counter()
        report = simulation.advance(pose, start + t)
        wp.synchronize()
        elapsed = 1e3 * (time.perf_counter() - begun)
        if t >= lead.duration:
            times.append(elapsed)
            reports.append(report)
            for name, value in report.times_ms.items():
                stages.setdefault(name, []).append(value)
        if options.record:
            cloth.append(simulation.cloth_positions())
            surface.append(simulation.body_positions())
    if options.record:
        np.savez_compressed(
            options.record,
            cloth=np.array(cloth),
            cloth_faces=dressed.welded.vertex_of_corner,
            body=np.array(surface),
            body_faces=body.faces,
            dt=1 / options.fps,
        )
    summary = {
        "device": str(wp.get_device(options.device).name),
        "garment": options.garment,
        "vertices": simulation.cloth_count,
        "preset": options.preset,
        "dressing_s": round(dressing, 1),
        "frame_ms_p50": round(float(np.percentile(times, 50)), 2),
        "frame_ms_p95": round(float(np.percentile(times, 95)), 2),
        "steps": sum(r.steps for r in reports) / len(reports),
        "substeps": sum(r.substeps for r in reports) / len(reports),
        "newton": sum(r.newton_iterations for r in reports) / len(reports),
        "pairs": reports[-1].pairs,
        "retries": sum(r.retries for r in reports),
        "max_lag_mm": round(1e3 * max(r.body_lag for r in reports), 2),
        "max_stretch": round(max(r.max_stretch for r in reports), 3),
        "stages_ms_p50": {name: round(float(np.median(values)), 2) for name, values in stages.items()},
    }
    print(json.dumps(summary, indent=1))


if __name__ == "__main__":
    main()
