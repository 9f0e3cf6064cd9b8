"""The parts of `python tests/accuracy` are importable by name."""

import sys
from pathlib import Path

for folder in (Path(__file__).parent / "support", Path(__file__).parents[2] / "solver" / "bench"):
    sys.path.append(str(folder))
