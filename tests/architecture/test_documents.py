"""What the documents name is there: files, functions, settings, commands, options, links."""

from __future__ import annotations

import argparse
import ast
import re
from functools import cache
from pathlib import Path

import pytest

from tryon_server.cli import build_parser

ROOT = Path(__file__).parents[2]
DOCUMENTS = ("METHOD.md", "README.md", "protocol/PROTOCOL.md")
# Where a name without a folder in front may be, as the document itself says.
PLACES = {
    "METHOD.md": ("", "solver/tryon_solver"),
    "README.md": ("", "solver/tryon_solver", "clients"),
    "protocol/PROTOCOL.md": ("protocol", "protocol/vectors", "protocol/vectors/malformed"),
}
# What a document's identifiers are taken from.
SOURCES = {
    "METHOD.md": ("solver", "server/tryon_server/runtime"),
    "README.md": ("solver", "server", "clients"),
    "protocol/PROTOCOL.md": ("protocol", "server/tryon_server/sessions", "solver/tryon_solver/redesign"),
}
SUFFIXES = (".py", ".md", ".json", ".yaml", ".sh", ".ts", ".png")


def prose(document: str) -> str:
    return re.sub(r"```.*?```", "", (ROOT / document).read_text(), flags=re.DOTALL)


def commands(document: str) -> str:
    """The blocks of code, lines that go on joined."""
    blocks = re.findall(r"```\w*\n(.*?)```", (ROOT / document).read_text(), flags=re.DOTALL)
    return "\n".join(blocks).replace("\\\n", " ")


def quoted(document: str) -> list[str]:
    """What stands in backticks, each once."""
    return sorted(set(re.findall(r"`([^`\n]+)`", prose(document))))


def is_path(text: str) -> bool:
    return bool(re.fullmatch(r"[\w.-]+(/[\w.-]+)*/?", text)) and ("/" in text or text.endswith(SUFFIXES))


def paths_of(document: str) -> list[tuple[str, str]]:
    """(path, names said to be in it) of everything in backticks that looks like one."""
    found = [quote.partition(": ") for quote in quoted(document)]
    return [(path, names) for path, _, names in found if is_path(path) and "NAME" not in path]


def found(document: str, path: str) -> Path | None:
    return next((ROOT / place / path for place in PLACES[document] if (ROOT / place / path).exists()), None)


@cache
def words(document: str) -> frozenset[str]:
    """Every identifier of the document's sources, keys of dictionaries among them."""
    files = [p for folder in SOURCES[document] for s in ("*.py", "*.ts") for p in (ROOT / folder).rglob(s)]
    return frozenset(word for path in files for word in re.findall(r"\w+", path.read_text()))


def defined_in(path: Path) -> set[str]:
    nodes = ast.walk(ast.parse(path.read_text()))
    return {n.name for n in nodes if isinstance(n, ast.FunctionDef | ast.ClassDef)}


@pytest.mark.parametrize("document", DOCUMENTS)
def test_named_files_and_functions_exist(document):
    listed = paths_of(document)
    assert len(listed) >= 3
    missing = [path for path, _ in listed if found(document, path) is None]
    assert missing == []
    for path, names in listed:
        wanted = {name.strip() for name in names.split(",") if name.strip()}
        assert wanted <= (defined_in(found(document, path)) if wanted else set()), path


@pytest.mark.parametrize("document", ["METHOD.md", "protocol/PROTOCOL.md"])
def test_named_settings_fields_and_constants_exist(document):
    names = [quote for quote in quoted(document) if re.fullmatch(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)*(\(\))?", quote)]
    names = [name for name in names if not name.endswith(SUFFIXES)]
    assert len(names) > 50
    parts = {part for name in names for part in name.removesuffix("()").split(".")}
    assert parts - words(document) == set()


@pytest.mark.parametrize("document", DOCUMENTS)
def test_links_lead_somewhere(document):
    text = prose(document)
    headings = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    anchors = {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}
    links = [link for link in re.findall(r"\]\(([^)]+)\)", text) if "://" not in link]
    for link in links:
        path, _, anchor = link.partition("#")
        assert not path or ((ROOT / document).parent / path).exists(), link
        assert not anchor or anchor in anchors, link
    assert links or document == "protocol/PROTOCOL.md"


def test_readme_names_make_targets_that_exist():
    text = " ".join((ROOT / "README.md").read_text().split())
    named = set(re.findall(r"(?:`|\s)make ([a-z]+)(?:`|\s+#)", text))
    targets = set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    assert {"demo", "test", "check", "lock"} <= named <= targets


def test_readme_gives_the_command_line_options_that_it_has():
    """Every `tryon COMMAND --option` of the document is taken by the parser of that command."""
    actions = build_parser()._actions
    parsers = next(action for action in actions if isinstance(action, argparse._SubParsersAction)).choices
    lines = [line.partition("#")[0] for line in commands("README.md").splitlines() if "/tryon " in line]
    assert len(lines) >= 4
    for line in lines:
        command, *rest = line.partition("/tryon ")[2].split()
        known = {option for action in parsers[command]._actions for option in action.option_strings}
        assert {word for word in rest if word.startswith("--")} <= known, line


def test_readme_gives_files_that_exist():
    """Files in its commands: scripts, patterns, compose files."""
    folders = "solver|server|docker|scripts|clients|protocol"
    named = re.findall(rf"(?<![\w./-])((?:{folders})/[\w./-]+)", commands("README.md"))
    assert len(named) >= 4
    assert [path for path in named if not (ROOT / path).exists()] == []


@pytest.mark.parametrize("document", DOCUMENTS)
def test_lines_are_short(document):
    """Rows of tables apart, which can't be broken."""
    lines = (ROOT / document).read_text().splitlines()
    assert [line for line in lines if len(line) > 120 and not line.startswith("|")] == []
