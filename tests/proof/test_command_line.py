"""What `python tests/proof` is told."""

import subprocess
import sys
from pathlib import Path

import pytest


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--only-strangers"], "--only-strangers needs --strangers FOLDER"),
        (["--only-strangers", "--strangers", "{}"], "holds neither .bvh nor"),
    ],
)
def test_strangers_alone_without_any_are_an_error(tmp_path: Path, options: list[str], says: str) -> None:
    """Nothing judged is nothing shown: not '0 of 0 cases kept every limit'."""
    empty, out = tmp_path / "empty", tmp_path / "out"
    empty.mkdir()
    told = [option.format(empty) for option in options]
    command = [sys.executable, str(Path(__file__).parent), "--out", str(out), *told]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert says in done.stderr
    assert "kept every limit" not in done.stdout
    assert not (out / "table.md").exists()
