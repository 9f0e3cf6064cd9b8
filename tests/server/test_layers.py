"""Who may import whom inside the server, read from the source."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import tryon_server

ROOT = Path(tryon_server.__file__).parent
SOURCES = sorted(path for path in ROOT.rglob("*.py") if "web" not in path.parts)


def imports(path: Path) -> set[str]:
    """Every module that a file imports, wherever in it."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: a relative import"
            names.add(node.module)
    return names


def importers(package: str) -> set[str]:
    """The server's packages and top-level modules that import ``package``."""
    return {
        path.relative_to(ROOT).parts[0].removesuffix(".py")
        for path in SOURCES
        if any(name == package or name.startswith(f"{package}.") for name in imports(path))
    }


@pytest.mark.parametrize(
    ("package", "allowed"),
    [
        ("tryon_solver", {"runtime", "garments"}),
        ("warp", set()),
        ("fastapi", {"app", "api"}),
        ("starlette", {"app", "api", "streaming"}),
        ("uvicorn", {"streaming"}),
        ("sqlalchemy", {"persistence"}),
        ("multiprocessing", {"runtime"}),
        ("trimesh", {"runtime"}),
    ],
)
def test_package_is_imported_only_where_it_belongs(package, allowed):
    assert importers(package) <= allowed
    assert len(SOURCES) > 40


def test_sessions_know_only_the_protocol():
    for path in (ROOT / "sessions").glob("*.py"):
        ours = {name for name in imports(path) if name.startswith("tryon_")}
        assert all(name.startswith(("tryon_protocol", "tryon_server.sessions")) for name in ours), path
        assert not imports(path) & {"asyncio", "time", "random", "secrets", "threading", "socket"}, path


@pytest.mark.parametrize("package", ["api", "streaming"])
def test_routes_and_streams_see_only_the_interface_of_the_runtime(package):
    allowed = {"tryon_server.runtime.interface", "tryon_server.runtime.order"}
    for path in (ROOT / package).glob("*.py"):
        assert {name for name in imports(path) if name.startswith("tryon_server.runtime")} <= allowed, path


def test_a_session_begins_without_what_few_edits_need():
    """scipy's optimize takes a fifth of a second, and is loaded by the edit that asks for it."""
    runtime = "tryon_server.runtime.worker, tryon_server.runtime.production"
    told = f"import sys, {runtime}; print('scipy.optimize' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", told], capture_output=True, text=True, check=True).stdout == "False\n"


def test_no_file_is_where_everything_goes():
    for path in SOURCES:
        assert len(path.read_text().splitlines()) < 500, path
