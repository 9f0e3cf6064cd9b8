"""Public dataclasses say of every array its shape and, unless it holds indices, its unit."""

import ast
import re
from pathlib import Path

import pytest

import tryon_solver

ROOT = Path(tryon_solver.__file__).parent
PUBLIC = (
    "scene.py",
    "effect_spec.py",
    "effect_specs.py",
    "sewn_specs.py",
    "state.py",
    "results.py",
    "geometry/garment.py",
    "geometry/pattern.py",
    "geometry/panel_mesh.py",
    "geometry/weld.py",
    "geometry/curves.py",
    "body/model.py",
    "body/pose.py",
    "body/motion.py",
)
ARRAY = re.compile(r"^(wp\.array|np\.ndarray|NDArray\[|Points$|Indices$)")
SHAPE = re.compile(r"\([\w* +-]+(,[\w\s+*-]*)*\)")
INTEGER = re.compile(r"int32|bool|Indices")
UNIT = re.compile(
    r"\b(m|kg|N|J|s|m/s|m/s\^2|N/m|m/N|m\^2|1/m|rad)\b|\bunit\b|quaternion|sum to 1|fraction|world from"
)


def files():
    return sorted({path for pattern in PUBLIC for path in ROOT.glob(pattern) if path.name != "__init__.py"})


def array_fields(path):
    """(class, field, type, text): text is what the field's own comment and the class's docstring say about it."""
    source = path.read_text()
    lines = source.splitlines()
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.ClassDef) or node.name.startswith("_"):
            continue
        if not any("dataclass" in ast.unparse(decorator) for decorator in node.decorator_list):
            continue
        doc = ast.get_docstring(node) or ""
        for field in node.body:
            if not isinstance(field, ast.AnnAssign) or not ARRAY.match(ast.unparse(field.annotation)):
                continue
            name = field.target.id
            own = lines[field.lineno - 1 : field.end_lineno]
            comment = " ".join(line.split("#", 1)[1] for line in own if "#" in line)
            said = re.search(rf"`{name}`[^;.]*", doc)
            yield node.name, name, ast.unparse(field.annotation), f"{comment} {said.group(0) if said else ''}".strip()


@pytest.mark.parametrize("path", files(), ids=lambda p: str(p.relative_to(ROOT)))
def test_arrays_have_shape_and_unit(path):
    for owner, name, kind, text in array_fields(path):
        place = f"{path.relative_to(ROOT)}: {owner}.{name} says {text!r}"
        assert SHAPE.search(text), f"{place}: give its shape, as in (N, 3)"
        assert INTEGER.search(kind + text) or UNIT.search(text), f"{place}: give its unit, as in m or N/m"


def test_the_scan_finds_fields():
    found = [field for path in files() for field in array_fields(path)]
    assert len(found) > 30
    assert ("State", "v", "wp.array", "(N,) vec3 m/s") in found
