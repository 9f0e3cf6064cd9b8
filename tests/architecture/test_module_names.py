"""Folders whose modules are imported by their bare names: one process loads them all, so a name stands for one file."""

from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).parents[2]
BARE = (ROOT / "solver" / "bench", ROOT / "tests" / "solver" / "bench", *sorted((ROOT / "tests").rglob("support")))


def test_no_two_of_them_share_a_name():
    files = defaultdict(list)
    for folder in BARE:
        for path in folder.glob("*.py"):
            if path.stem not in ("__init__", "__main__", "conftest"):
                files[path.stem].append(str(path.relative_to(ROOT)))
    assert len(files) > len(BARE)
    assert {name: paths for name, paths in files.items() if len(paths) > 1} == {}
