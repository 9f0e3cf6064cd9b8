"""Stores keep what they are given, whatever was there before."""

import hashlib
import os
from dataclasses import dataclass, replace

import msgspec
import pytest

from tryon_server.garments.check import CheckReply
from tryon_server.garments.limited import Limits, Work, run_limited, unforeseen
from tryon_server.garments.service import GarmentService
from tryon_server.persistence import (
    FileBlobs,
    GarmentRecord,
    KeptFiles,
    SessionRecord,
    SqlEdits,
    SqlGarments,
    SqlSessions,
    open_database,
)
from tryon_server.problems import ProblemError
from tryon_server.sessions.commands import HELD, ChangeEffect, ChangePattern
from tryon_server.streaming.histories import WaitingChanges


@dataclass
class Stores:
    garments: SqlGarments
    sessions: SqlSessions


@pytest.fixture
def stores(tmp_path):
    database = open_database(f"sqlite:///{tmp_path}/deep/tryon.sqlite3")
    return Stores(SqlGarments(database), SqlSessions(database))


def garment(name: str, created: float = 1.0) -> GarmentRecord:
    return GarmentRecord(
        id=name, name=name, digest="d" * 64, panel_count=2, seam_count=1, vertex_count=9, triangle_count=8, area=0.5,
        created=created,
    )  # fmt: skip


def test_what_waits_in_a_session_comes_back_in_its_order_whatever_it_is(tmp_path):
    waiting = WaitingChanges(SqlEdits(open_database(f"sqlite:///{tmp_path}/tryon.sqlite3")))
    wind = ChangeEffect(2, "wind", "active", {"velocity": [0, 0, 3]})
    for change in (ChangePattern("undo", 1), wind, ChangeEffect(3, "gravity", "absent")):
        waiting.keep("session", change.ticket, change)
    undo, *effects = waiting.of("session")
    assert (undo.step, undo.ticket) == ("undo", HELD)
    assert effects == [replace(wind, ticket=HELD), ChangeEffect(HELD, "gravity", "absent")]
    waiting.keep("session", 2, None)
    assert [type(change) for change in waiting.of("session")] == [ChangePattern, ChangeEffect]
    assert waiting.of("another") == waiting.of(None) == []


def test_garments_come_back_oldest_first_and_are_replaced_by_id(stores):
    stores.garments.add(garment("b", 2.0))
    stores.garments.add(garment("a", 1.0))
    stores.garments.add(msgspec.structs.replace(garment("b", 2.0), area=0.75))
    assert [(entry.id, entry.area) for entry in stores.garments.all()] == [("a", 0.5), ("b", 0.75)]
    assert stores.garments.get("a") == garment("a")
    assert stores.garments.get("c") is None


def test_a_garment_is_forgotten_with_how_it_was_read(stores):
    read = msgspec.structs.replace(garment("mesh"), units="cm", rest_shape="shape", notes=("cm, Z up",))
    stores.garments.add(read)
    assert stores.garments.get("mesh") == read
    stores.garments.remove("mesh")
    stores.garments.remove("never was")
    assert stores.garments.get("mesh") is None
    stores.garments.add(garment("mesh"))
    assert stores.garments.get("mesh") == garment("mesh")


def test_a_file_stays_until_the_last_one_lets_go(tmp_path):
    recorded: set[str] = set()
    files = KeptFiles(FileBlobs(tmp_path / "blobs"), recorded.__contains__)
    one, two = files.put(b"one"), files.put(b"two")
    recorded.update((one, two))
    files.hold("first", one)
    files.hold("second", one)
    files.hold("second", two)
    recorded.discard(one)
    for still, who in ((True, "nobody"), (True, "first"), (False, "second")):
        files.let_go(who)
        files.forget(one)
        assert (tmp_path / "blobs" / one[:2] / one).exists() is still
    assert files.path(two).read_bytes() == b"two", "a record names it"
    with pytest.raises(KeyError):
        files.path(one)


def test_session_keeps_its_first_ending_and_a_restart_ends_the_rest(stores):
    for name in ("one", "two"):
        stores.sessions.add(SessionRecord(id=name, garment="g", motion=None, fabric="f", preset="draft", created=1.0))
    stores.sessions.end("one", 5.0, "done")
    stores.sessions.end("one", 6.0, "again")
    assert stores.sessions.end_all_open(7.0, "restarted") == 1
    assert (stores.sessions.get("one").ended, stores.sessions.get("one").ending) == (5.0, "done")
    assert (stores.sessions.get("two").ended, stores.sessions.get("two").ending) == (7.0, "restarted")
    assert stores.sessions.get("three") is None


def test_sqlite_runs_in_write_ahead_mode(tmp_path):
    engine = open_database(f"sqlite:///{tmp_path}/tryon.sqlite3")
    with engine.connect() as connection:
        assert connection.exec_driver_sql("PRAGMA journal_mode").scalar() == "wal"


@pytest.mark.parametrize("url", ["nonsense", "unknown://x/y", "sqlite:////dev/null/x.sqlite3"])
def test_database_that_cannot_be_opened_is_one_clear_error(url):
    with pytest.raises(ProblemError, match="TRYON_SERVER_DATABASE_URL"):
        open_database(url)


def test_password_of_a_database_is_not_shown():
    with pytest.raises(ProblemError) as error:
        open_database("unknown://user:secret@host/db")
    assert "secret" not in str(error.value)


def test_blobs_are_kept_once_under_their_digest(tmp_path):
    blobs = FileBlobs(tmp_path / "blobs")
    digest = blobs.put(b"content")
    assert digest == hashlib.sha256(b"content").hexdigest()
    assert blobs.put(b"content") == digest
    assert blobs.path(digest).read_bytes() == b"content"
    assert len([path for path in (tmp_path / "blobs").rglob("*") if path.is_file()]) == 1
    with pytest.raises(KeyError):
        blobs.path("0" * 64)


def test_child_that_breaks_down_or_stays_too_long_is_a_clear_error(monkeypatch):
    import tryon_server.garments.limited as limited

    limits = Limits(seconds=0.2, address_space=2**30)
    work = Work("checking the pattern", "pattern.too_complex", "Use fewer edges")
    with pytest.raises(ProblemError, match="ended with status 1"):
        run_limited("this_module_does_not_exist", [], b"", limits, work)
    monkeypatch.setattr(limited, "STARTUP_SECONDS", 0.0)
    with pytest.raises(ProblemError, match=r"more than 0\.2 s"):
        run_limited("http.server", ["0"], b"", limits, work)


ENDS = {
    "raise SystemExit(limited.OUT_OF_MEMORY)": (422, "more than 1.0 GiB"),
    "limited.run_child(lambda: (_ for _ in ()).throw(MemoryError()))": (422, "more than 1.0 GiB"),
    "os.kill(os.getpid(), signal.SIGXCPU)": (422, "more than 30 s"),
    "os.kill(os.getpid(), signal.SIGSEGV)": (422, "broke down"),
    "raise ZeroDivisionError('a slip of ours')": (500, "a fault of the server's"),
}


@pytest.mark.parametrize("ends", ENDS)
def test_how_a_child_ended_is_told_as_what_it_was_and_logged(tmp_path, monkeypatch, caplog, ends):
    head = "import os, signal\nimport tryon_server.garments.limited as limited\n"
    (tmp_path / "odd_child.py").write_text(f"{head}{ends}\n")
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}{os.pathsep}{os.environ.get('PYTHONPATH', '')}")
    work = Work("checking the pattern", "pattern.too_complex", "Use fewer edges")
    status, says = ENDS[ends]
    with pytest.raises(ProblemError, match=says) as caught:
        run_limited("odd_child", [], b"", Limits(seconds=30.0, address_space=2**30), work)
    assert caught.value.status == status
    assert caught.value.problem.code == ("server.fault" if status == 500 else "pattern.too_complex")
    assert ("a slip of ours" in caplog.text) == (status == 500)


def test_the_traceback_of_a_check_that_nobody_thought_of_is_in_the_log(tmp_path, monkeypatch, caplog):
    def fails(*_) -> bytes:
        fault = unforeseen("checking the garment", "KeyError: 'x'")
        return msgspec.json.encode(CheckReply(problem=fault.problem, status=fault.status, trace="in breaks, line 7"))

    monkeypatch.setattr("tryon_server.garments.service.run_limited", fails)
    garments = SqlGarments(open_database(f"sqlite:///{tmp_path}/tryon.sqlite3"))
    files = KeptFiles(FileBlobs(tmp_path / "blobs"), lambda _: False)
    service = GarmentService(garments, files, Limits(seconds=1.0, address_space=2**30))
    with pytest.raises(ProblemError, match="a fault of the server's") as caught:
        service.add(b"{}", "odd")
    assert caught.value.status == 500
    assert "in breaks, line 7" in caplog.text
    assert service.all() == []
