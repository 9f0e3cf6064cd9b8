"""The codes of errors: the document's table, the sets in errors.py and what the code raises are the same."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from tryon_protocol.errors import BUILDING_CODES, ERROR_CODES, READING_CODES

ROOT = Path(__file__).parents[2]
PYTHON = ("protocol/tryon_protocol", "server/tryon_server", "clients/python/tryon_client")
TYPESCRIPT = ("protocol/ts/src", "clients/core/src", "clients/web/src")
MAKERS = {"ProtocolError", "Troubled", "_trouble", "_known", "unknown"}  # their first argument is a code


def raised_in_python() -> Iterator[tuple[str, Path]]:
    for path in (path for folder in PYTHON for path in (ROOT / folder).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            if not isinstance(node, ast.Call):
                continue
            name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            if name in MAKERS and isinstance(node.args[0], ast.Constant):
                yield node.args[0].value, path


def raised_in_typescript() -> Iterator[tuple[str, Path]]:
    for path in (path for folder in TYPESCRIPT for path in (ROOT / folder).rglob("*.ts")):
        for code in re.findall(r'new ProtocolError\(\s*"(\w+)"', path.read_text()):
            yield code, path


def section_6() -> str:
    text = (ROOT / "protocol" / "PROTOCOL.md").read_text()
    return text[text.index("## 6. Errors") : text.index("## 7. Frames")]


def test_the_documents_table_is_what_a_server_may_send():
    rows = re.findall(r"^\| (`.*?) \|", section_6(), re.MULTILINE)
    listed = [code for row in rows for code in re.findall(r"`(\w+)`", row)]
    assert len(listed) == len(set(listed)), "a code stands twice"
    assert set(listed) == ERROR_CODES


def test_the_document_lists_what_a_reader_raises():
    after_table = section_6().rpartition("|\n")[2]
    assert set(re.findall(r"`(\w+)`", after_table)) - {"keyframe_request"} == READING_CODES


@pytest.mark.parametrize("raised", [raised_in_python, raised_in_typescript])
def test_every_code_that_is_raised_is_known(raised):
    found = list(raised())
    assert len(found) >= 5
    unknown = [(code, str(path.relative_to(ROOT))) for code, path in found]
    unknown = [entry for entry in unknown if entry[0] not in ERROR_CODES | READING_CODES | BUILDING_CODES]
    assert unknown == []


def test_every_known_code_is_raised_somewhere():
    assert {code for code, _ in raised_in_python()} == ERROR_CODES | READING_CODES | BUILDING_CODES
