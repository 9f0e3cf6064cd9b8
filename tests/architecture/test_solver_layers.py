"""The solver's inner layering: lower never imports higher, by every module's imports as written."""

import ast
import sys
from pathlib import Path

import pytest

import tryon_solver

ROOT = Path(tryon_solver.__file__).parent
LONGEST_FILE = 600

# From the ground up. Modules of one layer may import each other's, if they are in the same folder or listed in BESIDE.
LAYERS = (
    ("checks",),
    ("effect_words",),
    ("geometry", "linalg", "settings", "device"),
    ("redesign",),
    ("state", "results"),
    ("plan",),
    ("materials", "subspace", "contact", "body"),
    ("files",),
    ("advice",),
    ("effect_spec",),
    ("effect_specs", "sewn_specs"),
    ("scene",),
    ("offsets",),
    ("effects", "stepping", "worn_effects"),
    ("step", "kernels"),
    ("simulation",),
    ("reshape", "build_in_parts"),
    ("dressing", "baselines", "live_edit", "rebind", "value_ramps", "diff"),
    ("drawn",),
)


def modules():
    """Dotted name below tryon_solver -> file, packages without __init__."""
    found = {}
    for path in sorted(ROOT.rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        if parts[-1] != "__init__":
            found[".".join(parts)] = path
    return found


def imports_of(path):
    """Names imported when the program runs, wherever in the file: what stands under TYPE_CHECKING does not."""
    tree = ast.parse(path.read_text())
    for node in ast.walk(tree):
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            node.body = []
    names = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            names += [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
    return names


def layer_of(module):
    top = module.split(".")[0]
    return next((k for k, layer in enumerate(LAYERS) if top in layer), None)


@pytest.mark.parametrize("module", modules())
def test_every_module_has_a_layer(module):
    assert layer_of(module) is not None, f"tryon_solver.{module} is in no layer of this test: add its folder"


@pytest.mark.parametrize("module", modules())
def test_lower_never_imports_higher(module):
    own = module.split(".")[0]
    for name in imports_of(modules()[module]):
        if not name.startswith("tryon_solver."):
            continue
        other = name.removeprefix("tryon_solver.").split(".")[0]
        if other == own or layer_of(other) is None:
            continue
        assert layer_of(other) < layer_of(module), f"tryon_solver.{module} imports tryon_solver.{other}"


@pytest.mark.parametrize("module", modules())
def test_solver_stands_alone(module):
    """numpy, scipy and warp; set-up and development have more. Nothing private of Warp."""
    allowed = {"numpy", "scipy", "warp", "tryon_solver"}
    if module.startswith("body.making"):
        allowed |= {"trimesh", "fast_simplification"}  # they make the body at set-up
    if module.startswith("baselines.newton_ipc"):
        allowed |= {"ipctk"}  # the reference, which only tests and comparisons run
    if module == "body.report":
        allowed |= {"ipctk"}  # a developer's command, and says so
    for name in imports_of(modules()[module]):
        top = name.split(".")[0]
        if top in sys.stdlib_module_names:
            continue
        assert top in allowed, f"tryon_solver.{module} imports {name}"
        assert not name.startswith("warp._src"), f"tryon_solver.{module} reaches into {name}"


def test_the_scan_sees_imports():
    """A layering test that reads nothing would pass."""
    assert "tryon_solver.stepping.correct" in imports_of(ROOT / "step.py")
    assert "tryon_solver.simulation" in imports_of(ROOT / "dressing" / "dress.py")
    assert not any("simulation" in name for name in imports_of(ROOT / "stepping" / "correct.py"))
    assert len(modules()) > 40


@pytest.mark.parametrize("module", modules())
def test_file_is_short(module):
    length = len(modules()[module].read_text().splitlines())
    assert length < LONGEST_FILE, f"tryon_solver.{module} has {length} lines: split it by idea"


def test_kernels_stay_out_of_the_step():
    """step.py reads as the algorithm: one verb a line, no launch, no branch."""
    tree = ast.parse((ROOT / "step.py").read_text())
    for function in (n for n in tree.body if isinstance(n, ast.FunctionDef) and n.name in ("step", "advance")):
        assert "launch" not in ast.unparse(function)
        assert not any(isinstance(n, ast.If) for n in ast.walk(function)), function.name
        assert function.end_lineno - function.lineno < 40
