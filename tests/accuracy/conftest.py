"""The parts of `python tests/accuracy` are importable by name."""

import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
FOLDERS = ("accuracy/support", "precision", "hard_cases", "proof/support")
sys.path += [str(ROOT / "tests" / folder) for folder in FOLDERS] + [str(ROOT / "solver" / "bench")]
