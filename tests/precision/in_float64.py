"""The solver once more, in float64: `tryon_solver_float64` is `tryon_solver`, its source rewritten as it is imported.

The same files, with every number that is float32 there declared float64: vectors, matrices and arrays, parameters,
constants and literals of kernels, and what the host makes for the device. Not a statement is added, left out or moved,
so both take the same iterations by the same rules. Trees of boxes alone stay float32 (outward_boxes.py).
"""

from __future__ import annotations

import ast
import importlib.util
import linecache
import sys
from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from outward_boxes import OutwardTree, above, below

SINGLE, DOUBLE = "tryon_solver", "tryon_solver_float64"
TYPES = {
    ("wp", "float32"): "float64",
    ("np", "float32"): "float64",
    **{("wp", name): f"{name}d" for name in ("vec2", "vec3", "vec4", "mat22", "mat33", "mat44")},
}
SUPPLIED = {"OutwardTree": OutwardTree, "below": below, "above": above}  # names that rewritten modules use


class Rewriting(ast.NodeTransformer):
    """Of one module; `known` is the module itself, in float32, to look up what a name in a kernel stands for."""

    def __init__(self, known: ModuleType) -> None:
        self._known = known
        self._own: set[str] | None = None  # names that the kernel at hand gives values to; None outside of kernels

    def visit_Constant(self, node: ast.Constant) -> ast.expr:
        if isinstance(node.value, str) and node.value.split(".")[0] == SINGLE:
            return ast.Constant(renamed(node.value))
        if self._own is not None and isinstance(node.value, float):
            return double(node)
        return node

    def visit_Name(self, node: ast.Name) -> ast.expr:
        if self._own is None or node.id in self._own:
            return node
        return double(node) if isinstance(getattr(self._known, node.id, None), float) else node

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        name = called(node)
        if name == ("wp", "Bvh"):
            return ast.Name("OutwardTree", ast.Load())
        if name == ("wp", "inf"):
            return double(node)
        if name in TYPES:
            return ast.Attribute(node.value, TYPES[name], node.ctx)
        self.generic_visit(node)
        return node

    def visit_Call(self, node: ast.Call) -> ast.expr:
        name = called(node.func)
        if name == ("wp", "float64") and isinstance(node.args[0], ast.Constant | ast.Name):
            return node
        if self._own is not None and isinstance(node.func, ast.Name) and node.func.id == "float":
            inner = node.args[0]
            return double(inner if isinstance(inner, ast.Constant) else self.visit(inner))
        self.generic_visit(node)
        if name == ("wp", "HashGrid"):
            node.keywords.append(ast.keyword("dtype", attribute("wp", "float64")))
        if name == ("wp", "bvh_query_aabb"):
            tree, lower, upper = node.args
            node.args = [tree, call("below", lower), call("above", upper)]
        return node

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.stmt:
        if not decorated(node, "kernel", "func", "func_native"):
            self.generic_visit(node)
            return node
        for argument in node.args.args:
            argument.annotation = self._declared(argument.annotation)
        node.returns = self._declared(node.returns)
        stored = (n.id for n in ast.walk(node) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store))
        self._own = {argument.arg for argument in node.args.args} | set(stored)
        node.body = [self.visit(statement) for statement in node.body]
        self._own = None
        return node

    def visit_ClassDef(self, node: ast.ClassDef) -> ast.stmt:
        if decorated(node, "struct"):
            for field in node.body:
                if isinstance(field, ast.AnnAssign):
                    field.annotation = self._declared(field.annotation) or field.annotation
            return node
        self.generic_visit(node)
        return node

    def visit_Import(self, node: ast.Import) -> ast.stmt:
        for alias in node.names:
            alias.name = renamed(alias.name)
        return node

    def visit_ImportFrom(self, node: ast.ImportFrom) -> ast.stmt:
        node.module = renamed(node.module or "")
        return node

    def _declared(self, annotation: ast.expr | None) -> ast.expr | None:
        if isinstance(annotation, ast.Name) and annotation.id == "float":
            return attribute("wp", "float64")
        return None if annotation is None else self.visit(annotation)


def renamed(module: str) -> str:
    """The twin's name of a module of the solver; any other stays."""
    first, dot, rest = module.partition(".")
    return f"{DOUBLE}{dot}{rest}" if first == SINGLE else module


def called(node: ast.expr) -> tuple[str, str] | None:
    """("wp", "vec3") of wp.vec3."""
    if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
        return node.value.id, node.attr
    return None


def decorated(node: ast.FunctionDef | ast.ClassDef, *names: str) -> bool:
    """Is it Warp's, by one of these decorators?"""
    makers = [d.func if isinstance(d, ast.Call) else d for d in node.decorator_list]
    return any(called(maker) in {("wp", name) for name in names} for maker in makers)


def attribute(module: str, name: str) -> ast.Attribute:
    return ast.Attribute(ast.Name(module, ast.Load()), name, ast.Load())


def call(name: str, argument: ast.expr) -> ast.Call:
    return ast.Call(ast.Name(name, ast.Load()), [argument], [])


def double(value: ast.expr) -> ast.Call:
    """wp.float64(value), which keeps all digits of a literal."""
    return ast.Call(attribute("wp", "float64"), [value], [])


class Rewritten(Loader):
    """Loads one module of the twin."""

    def __init__(self, original: str, path: Path) -> None:
        self._original, self._path = original, path

    def exec_module(self, module: ModuleType) -> None:
        known = import_module(self._original)
        tree = Rewriting(known).visit(ast.parse(self._path.read_text(encoding="utf-8")))
        source = ast.unparse(ast.fix_missing_locations(tree)) + "\n"
        name = f"<{module.__name__}>"
        # Warp reads a kernel's source by its file name
        linecache.cache[name] = (len(source), None, source.splitlines(keepends=True), name)
        module.__dict__.update(SUPPLIED)
        exec(compile(source, name, "exec"), module.__dict__)


class Finder(MetaPathFinder):
    """Finds the twin's modules where the solver's are."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None  # noqa: ARG002
    ) -> ModuleSpec | None:
        first, dot, rest = fullname.partition(".")
        if first != DOUBLE:
            return None
        original = importlib.util.find_spec(f"{SINGLE}{dot}{rest}")
        if original is None or original.origin is None:
            return None
        loader = Rewritten(original.name, Path(original.origin))
        package = original.submodule_search_locations is not None
        return importlib.util.spec_from_loader(fullname, loader, is_package=package)


def twin_module(name: str) -> Any:
    """The twin's module of that name within the solver, such as "simulation"."""
    if not any(isinstance(finder, Finder) for finder in sys.meta_path):
        sys.meta_path.insert(0, Finder())
    return import_module(f"{DOUBLE}.{name}")


def twin_of(value: Any) -> Any:
    """The same data as the twin's classes, its float32 arrays as float64: scenes, settings, poses."""
    if isinstance(value, np.ndarray):
        return value.astype(np.float64) if value.dtype == np.float32 else value
    if isinstance(value, tuple | list):
        return type(value)(twin_of(item) for item in value)
    module, dot, name = type(value).__module__.partition(".")
    if not (is_dataclass(value) and module == SINGLE and dot):
        return value
    same = object.__new__(getattr(twin_module(name), type(value).__name__))
    for field in fields(value):
        object.__setattr__(same, field.name, twin_of(getattr(value, field.name)))
    return same
