"""Kernels are compiled side by side on a GPU: all that a step calls, in the block sizes it calls them by."""

import re
import sys
from pathlib import Path

import pytest
import warp as wp
from small_scenes import STILL, icosphere, layers, rigid_body

import tryon_solver
from tryon_solver.kernels import IN_BLOCKS, compile_kernels
from tryon_solver.scene import Scene
from tryon_solver.simulation import build

PACKAGE = Path(tryon_solver.__file__).parent


def test_every_module_that_launches_by_blocks_of_its_own_is_listed():
    asking = {
        ".".join(("tryon_solver", *path.relative_to(PACKAGE).with_suffix("").parts))
        for path in PACKAGE.rglob("*.py")
        if re.search(r"\bblock_dim=(?!block_dim\b)|\blaunch_one_block\(", path.read_text())
    }
    assert asking == {f"tryon_solver.{module}" for _, modules in IN_BLOCKS for module in modules}


def test_a_cpu_compiles_what_it_calls():
    before = loaded()
    compile_kernels("cpu")
    assert loaded() == before


@pytest.mark.gpu
def test_nothing_is_compiled_later():
    wp.init()
    if not wp.is_cuda_available():
        pytest.skip("no CUDA device on this machine")
    garment, x = layers(2, 9, 9, 0.1, 0.004)
    ball = rigid_body(*icosphere(0.05, 2))
    sim = build(Scene(garment, x + [0, 0.06, 0], ball), None, "cuda:0", STILL)
    before = loaded()
    assert len(before) > 20
    for k in range(1, 6):
        report = sim.advance(STILL, k / 60)
    assert report.pairs > 0
    assert loaded() - before == set()


def loaded() -> set[tuple[str, object]]:
    """Modules of the solver that are loaded, and for which block size on which device."""
    names = [name for name in sys.modules if name.startswith("tryon_solver.")]
    return {(name, variant) for name in names for variant in wp.get_module(name).execs}
