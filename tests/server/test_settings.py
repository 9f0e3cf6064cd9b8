"""Settings are read once, checked and frozen."""

from dataclasses import replace
from pathlib import Path

import pytest

from tryon_server.problems import ProblemError
from tryon_server.sessions.smoothing import Smoothing
from tryon_server.settings import Settings, read_settings


def test_defaults_are_embedded_and_local():
    settings = read_settings({"PATH": "/bin", "TRYON_BODY": "elsewhere.npz"})
    assert (settings.host, settings.port) == ("127.0.0.1", 8000)
    assert settings.effective_database_url().endswith("var/tryon.sqlite3")


def test_environment_and_overrides():
    environment = {
        "TRYON_SERVER_PORT": "9000",
        "TRYON_SERVER_HOST": "0.0.0.0",
        "TRYON_SERVER_DATA_DIR": "/data",
        "TRYON_SERVER_ALLOWED_ORIGINS": "https://a.example, https://b.example",
        "TRYON_SERVER_DATABASE_URL": "postgresql://db/tryon",
    }
    settings = read_settings(environment, port=9100, host=None)
    assert (settings.host, settings.port, settings.data_dir) == ("0.0.0.0", 9100, Path("/data"))
    assert settings.allowed_origins == ("https://a.example", "https://b.example")
    assert settings.effective_database_url() == "postgresql://db/tryon"


@pytest.mark.parametrize(
    ("name", "value"),
    [("PORT", "http"), ("PORT", "70000"), ("MAX_SESSIONS", "0"), ("SESSION_GRACE_SECONDS", "-1"), ("PROT", "8000")]
    + [(f"SMOOTHING_{name}", "0") for name in ("PLACE_SPEED_MAX", "TURN_SPEED_MAX", "PLACE_LAG", "TURN_LAG")],
)
def test_wrong_value_or_name_is_refused_with_its_name(name, value):
    with pytest.raises(ProblemError) as error:
        read_settings({f"TRYON_SERVER_{name}": value})
    assert error.value.problem.place == f"TRYON_SERVER_{name}"


def test_what_is_set_of_the_filter_reaches_it():
    assert Settings().smoothing() == Smoothing()
    names = [name for name in Settings.__struct_fields__ if name.startswith("smoothing_")]
    assert len(names) == 9
    for k, name in enumerate(names):
        settings = read_settings({f"TRYON_SERVER_{name.upper()}": str(100.0 + k)})
        field = name.removeprefix("smoothing_")
        assert settings.smoothing() == replace(Smoothing(), **{field: 100.0 + k})


def test_settings_are_frozen():
    with pytest.raises(AttributeError):
        Settings().port = 1
