"""The helpers of the server's tests are importable by name, also in the processes that the server spawns."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "support"))
