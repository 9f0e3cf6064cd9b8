"""Is a plain T-shirt slower than before the effects? `python before_effects.py [--frames 90] [--document FILE]`.

The solver of an earlier commit is put into a folder of its own. Two processes, one with that solver and one with this
one, play the same dressed T-shirt on a walking body, frame by frame in turn, so that whatever else the machine does
meets both alike. Prints means, medians and their ratios, and how far from balance either ends its frames, as it
estimates that itself; with --document they are written into that file anew.
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
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
BEFORE = "2a44b3b"  # the last commit without them
BEGIN, END = "<!-- made by before_effects.py -->", "<!-- until there -->"
BODY = ROOT / ".cache" / "tryon" / "body.npz"
EDGE = 0.0175  # m: 2,500 vertices
ROWS = (  # preset, frames a second, correction_nearness in place of the preset's for the solver of now
    ("draft", 30, None),
    ("draft", 30, 0.05),
    ("draft", 90, None),
    ("live", 60, None),
)
THREADS = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}


def dress(path: Path) -> None:
    """Write the T-shirt as it is worn at first; what both begin with."""
    sys.path[:0] = [str(ROOT / "tests" / "support"), str(ROOT / "solver")]
    from worn_garment import dressed_demo

    worn = dressed_demo("tshirt", EDGE)
    g = worn.garment
    np.savez(path, faces=g.faces, uv=g.uv_corners, panel=g.panel_of_face, x=worn.x, surface=worn.surface)


def play(path: Path, preset: str, rate: int, nearness: float | None) -> None:
    """A frame for each line that is read: writes `frame`, its wall and its processor time in ms, its Newton iterations
    and its estimated error in mm; first `ready`."""
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
    settings = PRESETS[preset] if nearness is None else replace(PRESETS[preset], correction_nearness=nearness)
    sim = build(scene, settings, "cpu", Pose.rest(body), kept["surface"])
    print("ready", len(kept["x"]), Path(tryon_solver.__file__).parents[1], flush=True)
    for frame, _ in enumerate(sys.stdin, 1):
        begun, spent = time.perf_counter(), time.process_time()
        at = frame / rate
        report = sim.advance(into.sample(at) if at < 1.0 else motion.sample(at - 1.0), at)
        took = 1e3 * (time.perf_counter() - begun), 1e3 * (time.process_time() - spent)
        print("frame", *took, report.newton_iterations, 1e3 * report.error, flush=True)


def solver_of(commit: str, folder: Path) -> Path:
    """The folder that the solver's package is in, as it was."""
    packed = subprocess.run(["git", "-C", str(ROOT), "archive", commit, "solver"], capture_output=True, check=True)
    subprocess.run(["tar", "-x", "-C", str(folder)], input=packed.stdout, check=True)
    return folder / "solver"


def compare(
    commit: str, preset: str, rate: int, nearness: float | None, frames: int, folder: Path, worn: Path
) -> dict[str, Any]:
    """Both in turn; `nearness` is told to the solver of now alone."""
    players, solvers = [], [solver_of(commit, folder), ROOT / "solver"]
    for solver, near in zip(solvers, (None, nearness), strict=True):
        command = [sys.executable, str(Path(__file__).resolve()), "--play", str(worn), preset, str(rate)]
        command += [] if near is None else [str(near)]
        environment = {"TRYON_BODY": str(BODY), **os.environ, **THREADS, "PYTHONPATH": str(solver)}
        players.append(
            subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment)
        )
    ready = [said(player, "ready") for player in players]
    if [Path(told) for _, told in ready] != solvers:
        raise RuntimeError(f"other solvers are installed in front of those to compare: {ready}")
    vertices = int(ready[0][0])
    times = np.zeros((frames, len(players), 4))
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
    return {
        **{"preset": preset, "rate": rate, "nearness": nearness, "vertices": vertices, "frames": frames},
        "ms": told[..., 0].mean(axis=0).tolist(),
        "processor_ms": told[..., 1].mean(axis=0).tolist(),
        "processor_ms_median": np.median(told[..., 1], axis=0).tolist(),
        "newton": told[..., 2].mean(axis=0).tolist(),
        "error_mm": np.sqrt((told[..., 3] ** 2).mean(axis=0)).tolist(),
    }


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
        f"{commit}, the last without these effects, and by this one: frame by frame in turn, {found[0]['frames']}",
        f"frames, on one of {os.cpu_count()} cores ({platform.machine()}). Times and Newton iterations are means over",
        "frames, with the ratio of the medians beside that of the means; the error is the one that either solver",
        "estimates, a root mean square over frames.",
        "",
        "| preset | frames a second | ms before | ms now | ratio | processor ms before | now | ratio | of the medians "
        "| Newton iterations before | now | error before, mm | now |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for row in found:
        (wall, wall_now), (spent, spent_now) = row["ms"], row["processor_ms"]
        median, median_now = row["processor_ms_median"]
        figures = f"{wall:.1f} | {wall_now:.1f} | {wall_now / wall:.3f} | {spent:.1f} | {spent_now:.1f}"
        ratios = f"{spent_now / spent:.3f} | {median_now / median:.3f}"
        (newton, newton_now), (error, error_now) = row["newton"], row["error_mm"]
        came = f"{newton:.1f} | {newton_now:.1f} | {error:.2f} | {error_now:.2f}"
        nearness = row["nearness"]
        played = row["preset"] if nearness is None else f"{row['preset']}, now by `correction_nearness` {nearness}"
        lines.append(f"| {played} | {row['rate']} | {figures} | {ratios} | {came} |")
    return "\n".join([*lines, "", END])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--commit", default=BEFORE, help=f"to compare with ({BEFORE})")
    parser.add_argument("--frames", type=int, default=90)
    parser.add_argument("--document", type=Path, help="a file whose table is written anew")
    parser.add_argument("--play", nargs="+", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.play:
        worn, preset, rate, *nearness = asked.play
        play(Path(worn), preset, int(rate), float(nearness[0]) if nearness else None)
        return
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        dressed = folder / "worn.npz"
        dress(dressed)
        found = [compare(asked.commit, *row, asked.frames, folder, dressed) for row in ROWS]
    print(json.dumps(found))
    text = table(found, asked.commit)
    print(text)
    if asked.document is not None:
        head, _, rest = asked.document.read_text().partition(BEGIN)
        asked.document.write_text(head + text + rest.partition(END)[2])


if __name__ == "__main__":
    main()
