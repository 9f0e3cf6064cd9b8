"""All kernels of a GPU compiled side by side, before the first of them is called."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from importlib import import_module

import warp as wp

from tryon_solver.linalg.blocks import BLOCK
from tryon_solver.linalg.ell import WIDE_BLOCK
from tryon_solver.linalg.gauss_jordan import THREADS
from tryon_solver.linalg.one_block import ONE_BLOCK
from tryon_solver.linalg.warps import WARP
from tryon_solver.subspace.search import ALONE
from tryon_solver.subspace.search import BLOCK as SEARCH_BLOCK

PACKAGE = "tryon_solver"
WARPS_OWN = 256  # threads a block; told, since untold it is what a module was called with before
IN_BLOCKS = (
    (BLOCK, ("linalg.as_one", "linalg.pcg_together", "linalg.turning", "linalg.vectors", "stepping.gradient")),
    (ONE_BLOCK, ("linalg.one_block",)),
    (THREADS, ("linalg.gauss_jordan",)),
    (SEARCH_BLOCK, ("subspace.search",)),
    (ALONE, ("subspace.search",)),
    (WIDE_BLOCK, ("linalg.ell",)),
    (WARP, ("contact.packets",)),
)
"""Threads a block where they are not Warp's own number, each compiled for itself, and what launches so, where it is
imported."""


def compile_kernels(device: str) -> None:
    """Compile and load what has been imported of the solver, a module a thread; quick where it is in Warp's cache.

    One after the other, as they are called, a GPU's modules take minutes the first time. On a CPU nothing is done: its
    compiler gains nothing from threads, and what a scene does not call is better left alone.
    """
    if not wp.get_device(device).is_cuda:
        return
    workers = os.cpu_count() or 1
    wp.load_module(PACKAGE, device, True, WARPS_OWN, workers)  # of all below it
    for threads, modules in IN_BLOCKS:
        names = [name for module in modules if (name := f"{PACKAGE}.{module}") in sys.modules]
        wp.force_load(device, [wp.get_module(name) for name in names], threads, workers)


def compile_effects(modules: Sequence[str], device: str) -> None:
    """Have the kernels of these modules of effects in Warp's cache, and those that they import: for whoever binds them
    later, in another process. What a scene without effects has is imported and not compiled."""
    import_module(f"{PACKAGE}.simulation")
    before = set(sys.modules)
    for module in modules:
        import_module(module)
    if wp.get_device(device).is_cuda:
        compile_kernels(device)
        return
    own = {*modules, *(name for name in sys.modules if name.startswith(PACKAGE) and name not in before)}
    for name in sorted(filter(_has_kernels, own)):
        wp.load_module(name, device)


def _has_kernels(name: str) -> bool:
    """Has the module with that name any kernel or function of its own?"""
    for value in vars(sys.modules[name]).values():
        module = value.module if isinstance(value, (wp.Kernel, wp.Function)) else None
        if module is not None and module.name == name:
            return True
    return False
