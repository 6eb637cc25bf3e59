"""Tests of the environment: as declared, with every dependency capped and explained, and with one engine."""

import re
import tomllib
from importlib.metadata import distributions, version
from pathlib import Path

import mujoco
import pytest
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet

from cellwright.engine.installed import RUNS_ON

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
REQUIREMENTS = [
    Requirement(line) for line in [*PROJECT["project"]["dependencies"], *PROJECT["dependency-groups"]["dev"]]
]
ON_REQUEST = [
    Requirement(line)
    for line in [
        *(each for extra in PROJECT["project"]["optional-dependencies"].values() for each in extra),
        *PROJECT["dependency-groups"]["hooks"],
    ]
]


@pytest.mark.parametrize("requirement", REQUIREMENTS, ids=lambda each: each.name)
def test_dependencies_are_capped_installed_and_explained(requirement: Requirement) -> None:
    operators = {each.operator for each in requirement.specifier}
    assert {">=", "<"} <= operators
    if requirement.marker is None or requirement.marker.evaluate():
        assert version(requirement.name) in requirement.specifier
    assert f"`{requirement.name}`" in (ROOT / "docs" / "dependencies.md").read_text()


@pytest.mark.parametrize("requirement", ON_REQUEST, ids=lambda each: each.name)
def test_requirement_on_request_is_capped_and_explained(requirement: Requirement) -> None:
    assert {">=", "<"} <= {each.operator for each in requirement.specifier}
    assert f"`{requirement.name}`" in (ROOT / "docs" / "dependencies.md").read_text()


def test_engine_is_mujoco_core_only() -> None:
    names = {re.sub(r"[-_.]+", "-", each.metadata["Name"]).lower() for each in distributions()}
    assert "mujoco" not in names, "the package mujoco writes over mujoco-core"
    assert "mujoco-core" in names
    assert mujoco.__version__ == version("mujoco-core")


def test_extras_are_installed_for_the_tests() -> None:
    """A test of an extra is skipped nowhere: the tests' tools contain each, in the same versions."""
    extras = {each for extra in PROJECT["project"]["optional-dependencies"].values() for each in extra}
    assert extras <= {*PROJECT["dependency-groups"]["dev"]}


def test_engine_checks_the_version_that_is_required() -> None:
    (required,) = [each for each in REQUIREMENTS if each.name == "mujoco-core"]
    assert required.specifier == SpecifierSet(RUNS_ON)


def test_version_is_defined_once() -> None:
    import cellwright

    assert version("cellwright") == cellwright.__version__ == PROJECT["project"]["version"]
