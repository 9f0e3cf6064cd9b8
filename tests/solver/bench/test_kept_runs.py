"""The script that has the runs of README's table: each asks for something that there is, and says so of another."""

import re
import shlex
import subprocess
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[3] / "scripts" / "bench_runs.sh"
RUNS = dict(re.findall(r"^    ([\w-]+)\) options=\((.*)\) ;;$", SCRIPT.read_text(), re.MULTILINE))


def test_all_are_listed():
    (names,) = re.findall(r'^NAMES="(.*)"$', SCRIPT.read_text(), re.MULTILINE)
    assert names.split() == list(RUNS)


@pytest.mark.parametrize("name", RUNS)
def test_its_options_are_some_of_the_bench(command_line, name):
    words = shlex.split(RUNS[name].replace('"${motions[@]}"', "walk jumping_jack"))
    options = command_line.parsed([*words, "--device", "cpu"])
    assert options.vertices
    assert options.seconds > 0


def test_no_run_is_refused_with_those_there_are():
    ran = subprocess.run([SCRIPT, "nosuch"], capture_output=True, text=True, timeout=60)
    assert ran.returncode == 2
    assert all(name in ran.stderr for name in RUNS)
