"""The npm workspace installs from any registry, and exactly what was tested."""

from __future__ import annotations

import json
from pathlib import Path

from tryon_protocol import generate_ts

ROOT = Path(generate_ts.__file__).resolve().parents[2]


def test_the_lock_names_no_registry_and_hashes_every_package() -> None:
    lock = json.loads((ROOT / "package-lock.json").read_text(encoding="utf-8"))
    fetched = {name: entry for name, entry in lock["packages"].items() if name.startswith("node_modules/")}
    linked = {name for name, entry in fetched.items() if entry.get("link")}
    assert {"node_modules/typescript", "node_modules/zstddec"} <= fetched.keys() - linked
    for name in fetched.keys() - linked:
        assert "resolved" not in fetched[name], f"{name} names a host: install with the .npmrc of this repository"
        assert fetched[name]["integrity"].startswith("sha512-")


def test_dependencies_are_pinned() -> None:
    for package in (ROOT, ROOT / "protocol" / "ts"):
        manifest = json.loads((package / "package.json").read_text(encoding="utf-8"))
        versions = {**manifest.get("dependencies", {}), **manifest.get("devDependencies", {})}
        assert versions
        assert {name for name, version in versions.items() if not version[0].isdigit()} == set()
