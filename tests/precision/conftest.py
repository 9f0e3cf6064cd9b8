"""The parts of `python tests/precision` are importable by name."""

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "hard_cases"), str(HERE.parent / "proof" / "support")]
