"""A crate uses only the crates above it, and ARCHITECTURE.md says so."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
ROOT_MANIFEST = ROOT / "Cargo.toml"

FOR_TESTS = frozenset({"sphereflow-sim", "sphereflow-io"})
"""What a crate's tests may use although it stands below: simulated worlds and files."""


def manifest(path: Path) -> dict[str, Any]:
    return tomllib.loads(path.read_text())


def members(root: Path) -> list[str]:
    return manifest(root)["workspace"]["members"]


def upward_arrows(crates: dict[str, dict[str, Any]]) -> list[str]:
    """Dependencies on a crate that does not stand above, as `from -> to (kind)`; the order of the
    dictionary is that of the workspace."""
    order = list(crates)
    found = []
    for index, (name, content) in enumerate(crates.items()):
        tables = [content, *content.get("target", {}).values()]
        for kind in ("dependencies", "build-dependencies", "dev-dependencies"):
            for target in {key for table in tables for key in table.get(kind, {})}:
                allowed = kind == "dev-dependencies" and target in FOR_TESTS | {name}
                if target in order and order.index(target) >= index and not allowed:
                    found.append(f"{name} -> {target} ({kind})")
    return sorted(found)


@pytest.fixture(scope="module")
def crates() -> dict[str, dict[str, Any]]:
    read = [manifest(ROOT / member / "Cargo.toml") for member in members(ROOT_MANIFEST)]
    return {content["package"]["name"]: content for content in read}


def test_crates_use_only_those_above_them(crates):
    assert upward_arrows(crates) == []


def test_arrow_upwards_is_found_in_every_kind_of_table():
    low = {"dependencies": {"high": {}}, "dev-dependencies": {"sphereflow-sim": {}}}
    tables = {
        "low": low,
        "middle": {"build-dependencies": {"high": {}}, "dependencies": {"low": {}}},
        "device": {"target": {"cfg(unix)": {"dependencies": {"high": {}}}}},
        "high": {"dev-dependencies": {"sphereflow-sim": {}}},
        "sphereflow-sim": {"dependencies": {"high": {}}},
    }
    assert upward_arrows(tables) == [
        "device -> high (dependencies)",
        "low -> high (dependencies)",
        "middle -> high (build-dependencies)",
    ]


def test_default_members_are_the_members_without_python():
    workspace = manifest(ROOT_MANIFEST)["workspace"]
    expected = [member for member in workspace["members"] if member != "crates/python"]
    assert workspace["default-members"] == expected


def test_architecture_names_every_crate_in_the_order_of_the_workspace():
    page = (ROOT / "ARCHITECTURE.md").read_text()
    named = re.findall(r"^\| `(crates/\w+)` \|", page, flags=re.MULTILINE)
    assert named == [member for member in members(ROOT_MANIFEST) if member.startswith("crates/")]


def test_every_folder_of_crates_is_a_member():
    folders = {f"crates/{path.parent.name}" for path in ROOT.glob("crates/*/Cargo.toml")}
    assert folders == {member for member in members(ROOT_MANIFEST) if member.startswith("crates/")}
