"""The parts of `python tests/covering` are importable by name."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parent / "support"))
