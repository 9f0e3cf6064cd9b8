"""A process beside a simulation does one task at a time, and is gone with whoever started it."""

import os
import signal
import subprocess
import sys
import time
from contextlib import closing
from functools import partial
from pathlib import Path

import pytest
import tasks

from tryon_server.runtime.beside import Made, NotMade, ProcessBeside, Told
from tryon_server.runtime.memory import own_bytes

PATIENCE = 60.0  # s, for a process to start on a busy machine


def until(condition):
    """What the condition comes to be, once it is something."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        value = condition()
        if value:
            return value
        time.sleep(0.01)
    raise AssertionError("it took too long")


def runs(number: int) -> bool:
    """Whether there is such a process; one that has ended and is not yet fetched does not run."""
    try:
        return Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def number_in(path: Path) -> int:
    return until(lambda: path.exists() and int(path.read_text() or 0))


@pytest.fixture(scope="module")
def beside():
    with closing(ProcessBeside()) as beside:
        yield beside


def outcome_of(beside, task):
    beside.begin(task)
    return until(beside.outcome)


def test_what_a_task_returns_comes_back_once(beside):
    assert beside.outcome() is None
    assert outcome_of(beside, partial(tasks.double, 21)) == Made(42)
    assert beside.outcome() is None
    assert outcome_of(beside, partial(tasks.double, 4)) == Made(8)


def test_a_task_tells_how_far_it_is_until_it_has_ended(beside, tmp_path):
    beside.begin(tasks.Counting(3, tmp_path / "go on"))
    seen = set()

    def last_news():
        assert beside.outcome() is None
        news = beside.news()
        seen.add(news)
        return news == Told("number 3", 1.0)

    until(last_news)
    assert beside.news() is None, "told once"
    (tmp_path / "go on").touch()
    assert until(beside.outcome) == Made(3)
    assert beside.news() is None


def test_a_task_may_be_longer_than_a_pipe_takes_at_once(beside):
    assert outcome_of(beside, partial(tasks.length, bytes(5_000_000))) == Made(5_000_000)


def test_what_is_refused_comes_with_its_remedy(beside):
    outcome = outcome_of(beside, tasks.refuse)
    assert isinstance(outcome, NotMade)
    problem = outcome.problem
    assert (problem.message, problem.remedy, problem.place) == ("it is crooked", "Draw it straight", "panels.front")


def test_a_task_that_fails_says_so_and_the_next_one_is_done(beside):
    outcome = outcome_of(beside, tasks.fail)
    assert isinstance(outcome, NotMade)
    assert "a screw is loose" in outcome.problem.message
    assert outcome.problem.remedy
    assert outcome_of(beside, partial(tasks.double, 1)) == Made(2)


def test_a_process_that_ends_is_told_and_started_anew(beside):
    outcome = outcome_of(beside, tasks.die)
    assert isinstance(outcome, NotMade)
    assert "ended" in outcome.problem.message
    assert outcome.problem.remedy
    assert outcome_of(beside, partial(tasks.double, 1)) == Made(2)


@pytest.mark.parametrize("replaced", [True, False])
def test_what_is_given_up_is_ended_in_the_middle(beside, tmp_path, replaced):
    beside.begin(partial(tasks.wait, tmp_path / "number"))
    number = number_in(tmp_path / "number")
    assert runs(number)
    if replaced:
        assert outcome_of(beside, partial(tasks.double, 3)) == Made(6), "the newest is done"
    else:
        beside.give_up()
        assert beside.outcome() is None
    until(lambda: not runs(number))


def test_what_is_short_is_waited_for_rather_than_ended(beside):
    """Another task is done by the same process, and what nobody waited for does not come back."""
    beside.begin(os.getpid)
    number = until(beside.outcome).value
    beside.begin(partial(time.sleep, 0.05), short=True)
    assert beside.doing is not None
    beside.begin(os.getpid)
    assert until(beside.outcome) == Made(number)
    beside.begin(partial(time.sleep, 600.0), short=True)
    beside.give_up()
    assert beside.doing is None
    until(lambda: not runs(number))


def test_a_task_that_was_not_read_yet_can_be_given_up():
    with closing(ProcessBeside()) as beside:
        beside.begin(partial(tasks.length, bytes(50_000_000)))  # the process has hardly been started
        beside.begin(partial(tasks.double, 3))
        assert until(beside.outcome) == Made(6)


OWNER = """
import sys, time
from functools import partial
from pathlib import Path
sys.path[:0] = sys.argv[2:]
import tasks
from tryon_server.runtime.beside import ProcessBeside
beside = ProcessBeside()
beside.begin(partial(tasks.wait, Path(sys.argv[1])))
time.sleep(600)
"""


@pytest.mark.parametrize("ending", [signal.SIGKILL, signal.SIGTERM])
def test_no_process_is_left_behind(tmp_path, ending):
    """Not even in the middle of a task by an owner that has no chance to say anything."""
    support = Path(__file__).parent / "support"
    owner = subprocess.Popen([sys.executable, "-c", OWNER, str(tmp_path / "number"), str(support), *sys.path])
    try:
        number = number_in(tmp_path / "number")
        assert runs(number)
        os.kill(owner.pid, ending)
        until(lambda: not runs(number))
    finally:
        owner.kill()
        owner.wait()


def test_its_memory_is_counted_as_its_owners():
    """So that what a session may take holds for what is made beside it, too."""
    with closing(ProcessBeside()) as beside:
        assert outcome_of(beside, partial(tasks.double, 1)) == Made(2)
        before = own_bytes(os.getpid())
        beside.begin(partial(tasks.hoard, 300_000_000))
        until(lambda: own_bytes(os.getpid()) > before + 200_000_000)
