"""Tests of what a release needs: one version everywhere, and a changelog with that version's section."""

import re
import tomllib
from pathlib import Path

import yaml

from cellwright import _package

ROOT = Path(__file__).parents[1]
VERSION = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
CHANGES = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_package_has_the_version() -> None:
    assert _package.VERSION == VERSION


def test_changelog_begins_with_unreleased_and_the_version() -> None:
    headings = re.findall(r"^## (.*)$", CHANGES, re.MULTILINE)
    assert headings[0] == "Unreleased"
    assert re.fullmatch(rf"{re.escape(VERSION)} \(\d{{4}}-\d\d-\d\d\)", headings[1])


def test_changelog_sections_have_known_kinds() -> None:
    kinds = set(re.findall(r"^### (.*)$", CHANGES, re.MULTILINE))
    assert kinds <= {"Know first", "Added", "Changed", "Fixed"}


def test_citation_names_version_and_date_of_the_changelog() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert citation["version"] == VERSION
    assert f"## {VERSION} ({citation['date-released']})\n" in CHANGES
