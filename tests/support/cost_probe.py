"""Runs one scene in a process of its own and says what it cost: `python cost_probe.py Effect,Effect,... [steady]`.

Prints one JSON object: modules imported, modules Warp loaded, kernels launched, files that allocated on the device, the
plan's description; with `steady`, how many allocations two further steps made, and that the counting works.
"""

from __future__ import annotations

import contextlib
import io
import json
import re
import sys

import warp as wp

wp.config.quiet = False  # Warp then says which module it loads or compiles

LAUNCHED: set[str] = set()


def watch(name: str) -> None:
    """Record the kernels that go through Warp's launch function `name`."""
    launch = getattr(wp, name)

    def recorded(kernel: wp.Kernel, *arguments: object, **named: object) -> object:
        dim = arguments[0] if arguments else named["dim"]
        if dim not in (0, [0], (0,)):  # a launch over nothing does nothing and loads nothing
            LAUNCHED.add(f"{kernel.module.name}.{kernel.key}")
        return launch(kernel, *arguments, **named)

    setattr(wp, name, recorded)


def report(tracker: wp.ScopedMemoryTracker) -> tuple[int, set[str]]:
    """Number of allocations since the tracker was cleared, and the files that hold live ones."""
    out = io.StringIO()
    tracker.report(file=out, max_items=100000)
    text = out.getvalue()
    totals = text.split("Peak usage")[0]
    count = sum(int(n) for n in re.findall(r"^\s+\S+\s+(\d+) \(", totals, flags=re.MULTILINE))
    return count, set(re.findall(r" : ([\w.]+\.py):\d+ : ", text))


def main(names: list[str], steady: bool) -> dict[str, object]:
    """Build the scene with the effects named, take some steps, and collect."""
    for launch in ("launch", "launch_tiled"):
        watch(launch)
    said = io.StringIO()
    with contextlib.redirect_stdout(said), wp.ScopedMemoryTracker("scene", print=False) as tracker:
        from small_scenes import STILL, fabric, icosphere, rigid_body, sheet

        wp.config.quiet = False
        from tryon_solver import scene as described
        from tryon_solver.simulation import build

        garment, x = sheet(9, 9, 0.3, 0.3)
        ball, faces = icosphere(0.1, 1)
        effects = tuple(getattr(described, name)() for name in names)
        body = rigid_body(ball, faces) if "BodyContact" in names else None
        x[:, 1] += 0.103
        drape = described.Scene(garment, x, body, fabric(), effects)
        pose = STILL if body else None
        tracker.clear()
        sim = build(drape, None, "cpu", pose)
        for k in range(80 if steady else 6):
            sim.advance(pose, (k + 1) / 60)
        allocations, files = report(tracker)
        further, control = None, None
        if steady:
            tracker.clear()
            for k in range(80, 82):
                sim.advance(pose, (k + 1) / 60)
            further = report(tracker)
            tracker.clear()
            kept = wp.zeros(7, dtype=wp.vec3, device="cpu")
            control = report(tracker)[0]
            assert kept.shape == (7,)
    return {
        "imported": sorted(name for name in sys.modules if name.startswith("tryon_solver.")),
        "loaded": sorted(set(re.findall(r"Module (\S+) \w+ load", said.getvalue()))),
        "launched": sorted(LAUNCHED),
        "allocations": allocations,
        "allocated_in": sorted(files),
        "steady_allocations": further and further[0],
        "steady_allocated_in": further and sorted(further[1]),
        "control_allocations": control,
        "plan": sim.plan.describe(),
        "pairs": sim.pairs.size,
    }


if __name__ == "__main__":
    print(json.dumps(main([n for n in sys.argv[1].split(",") if n], "steady" in sys.argv[2:])))
