"""Is a plain T-shirt slower than before the effects? `python before_effects.py [--frames 90] [--document FILE]`.

The solver of an earlier commit is put into a folder of its own. Two processes, one with that solver and one with this
one, play the same dressed T-shirt on a walking body, frame by frame in turn, so that whatever else the machine does
meets both alike. Prints medians and their ratio; with --document they are written into that file anew.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
BEFORE = "2a44b3b"  # the last commit without them
BEGIN, END = "<!-- made by before_effects.py -->", "<!-- until there -->"
BODY = ROOT / ".cache" / "tryon" / "body.npz"
EDGE = 0.0175  # m: 2,500 vertices
THREADS = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}


def dress(path: Path) -> None:
    """Write the T-shirt as it is worn at first; what both begin with."""
    sys.path[:0] = [str(ROOT / "tests" / "support"), str(ROOT / "solver")]
    from worn_garment import dressed_demo

    worn = dressed_demo("tshirt", EDGE)
    g = worn.garment
    np.savez(path, faces=g.faces, uv=g.uv_corners, panel=g.panel_of_face, x=worn.x, surface=worn.surface)


def play(path: Path, preset: str, rate: int) -> None:
    """A frame for each line that is read: writes `frame`, its wall and its processor time in ms and its Newton
    iterations; first `ready`."""
    import warp as wp

    wp.config.quiet = True
    import tryon_solver
    from tryon_solver.body import default_body, parse_bvh, retarget
    from tryon_solver.body.motion import blend_in
    from tryon_solver.body.pose import Pose
    from tryon_solver.geometry.garment import Garment
    from tryon_solver.scene import LIVE, Scene
    from tryon_solver.settings import PRESETS
    from tryon_solver.simulation import build

    kept, body = np.load(path), default_body()
    walk = ROOT / "server" / "tryon_server" / "demo" / "motions" / "walk.bvh"
    motion = retarget(parse_bvh(walk.read_text()), body)
    into = blend_in(Pose.rest(body), motion, 1.0)
    garment = Garment(kept["faces"], kept["uv"], kept["panel"], len(kept["x"]))
    scene = Scene(garment, kept["x"], body, effects=LIVE)
    sim = build(scene, PRESETS[preset], "cpu", Pose.rest(body), kept["surface"])
    print("ready", len(kept["x"]), Path(tryon_solver.__file__).parents[1], flush=True)
    for frame, _ in enumerate(sys.stdin, 1):
        begun, spent = time.perf_counter(), time.process_time()
        at = frame / rate
        report = sim.advance(into.sample(at) if at < 1.0 else motion.sample(at - 1.0), at)
        took = 1e3 * (time.perf_counter() - begun), 1e3 * (time.process_time() - spent)
        print("frame", *took, report.newton_iterations, flush=True)


def solver_of(commit: str, folder: Path) -> Path:
    """The folder that the solver's package is in, as it was."""
    packed = subprocess.run(["git", "-C", str(ROOT), "archive", commit, "solver"], capture_output=True, check=True)
    subprocess.run(["tar", "-x", "-C", str(folder)], input=packed.stdout, check=True)
    return folder / "solver"


def compare(commit: str, preset: str, rate: int, frames: int, folder: Path, worn: Path) -> dict[str, Any]:
    """Both in turn."""
    players, solvers = [], [solver_of(commit, folder), ROOT / "solver"]
    for solver in solvers:
        command = [sys.executable, str(Path(__file__).resolve()), "--play", str(worn), preset, str(rate)]
        environment = {"TRYON_BODY": str(BODY), **os.environ, **THREADS, "PYTHONPATH": str(solver)}
        players.append(
            subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment)
        )
    ready = [said(player, "ready") for player in players]
    if [Path(told) for _, told in ready] != solvers:
        raise RuntimeError(f"other solvers are installed in front of those to compare: {ready}")
    vertices = int(ready[0][0])
    times = np.zeros((frames, len(players), 3))
    for frame in range(frames):
        for k in (0, 1) if frame % 2 else (1, 0):
            stdin = players[k].stdin
            assert stdin is not None
            stdin.write("\n")
            stdin.flush()
            times[frame, k] = [float(word) for word in said(players[k], "frame")]
    for player in players:
        player.communicate()
    told = times[frames // 6 :]
    medians, newton = np.median(told[..., :2], axis=0), told[..., 2].mean(axis=0)
    alike = {"preset": preset, "rate": rate, "vertices": vertices, "frames": frames}
    return {**alike, "ms": medians.tolist(), "newton": newton.tolist()}


def said(player: subprocess.Popen[str], word: str) -> list[str]:
    """What stands behind the word in the next line that begins with it; Warp tells of modules in others."""
    assert player.stdout is not None
    while not (line := player.stdout.readline()).startswith(word):
        if not line:
            raise RuntimeError(f"a player ended with status {player.wait()}")
    return line.split()[1:]


def table(found: list[dict[str, Any]], commit: str) -> str:
    """In Markdown."""
    lines = [
        BEGIN,
        "",
        f"A T-shirt of {found[0]['vertices']} vertices in the walk, with the effects `LIVE`, by the solver of commit",
        f"{commit}, the last without these effects, and by this one: frame by frame in turn, medians of",
        f"{found[0]['frames']} frames, on one of {os.cpu_count()} cores ({platform.machine()}). How many Newton",
        "iterations a frame takes, in the mean, follows from when a correction ends (METHOD.md section 7), not from",
        "effects.",
        "",
        "| preset | frames a second | ms before | ms now | ratio | processor ms before | now | ratio "
        "| Newton iterations before | now |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for row in found:
        (wall, spent), (wall_now, spent_now) = row["ms"]
        figures = f"{wall:.1f} | {wall_now:.1f} | {wall_now / wall:.3f} | {spent:.1f} | {spent_now:.1f}"
        newton, newton_now = row["newton"]
        iterations = f"{newton:.1f} | {newton_now:.1f}"
        lines.append(f"| {row['preset']} | {row['rate']} | {figures} | {spent_now / spent:.3f} | {iterations} |")
    return "\n".join([*lines, "", END])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--commit", default=BEFORE, help=f"to compare with ({BEFORE})")
    parser.add_argument("--frames", type=int, default=90)
    parser.add_argument("--document", type=Path, help="a file whose table is written anew")
    parser.add_argument("--play", nargs=3, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.play:
        play(Path(asked.play[0]), asked.play[1], int(asked.play[2]))
        return
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        worn = folder / "worn.npz"
        dress(worn)
        presets = (("draft", 30), ("live", 60))
        found = [compare(asked.commit, preset, rate, asked.frames, folder, worn) for preset, rate in presets]
    print(json.dumps(found))
    text = table(found, asked.commit)
    print(text)
    if asked.document is not None:
        head, _, rest = asked.document.read_text().partition(BEGIN)
        asked.document.write_text(head + text + rest.partition(END)[2])


if __name__ == "__main__":
    main()
