"""The parts of `python tests/fabrics`, and the tailor's measures, are importable by name."""

import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path += [str(ROOT / "tests" / folder) for folder in ("fabrics/support", "accuracy/support")]
