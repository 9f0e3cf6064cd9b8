"""The examples are importable by name, as modules of who uses the package are."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
