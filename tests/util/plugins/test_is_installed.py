"""Tests of the look for a package that a command needs."""

from __future__ import annotations

from pathlib import Path

import pytest

from cellwright.util.plugins import is_installed


def test_folder_of_a_name_is_no_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "wandb_of_runs").mkdir()
    monkeypatch.syspath_prepend(tmp_path)
    assert not is_installed("wandb_of_runs")
    assert not is_installed("no_such_package")
    (tmp_path / "wandb_of_runs" / "__init__.py").write_text("raise RuntimeError('found, not run')", encoding="utf-8")
    assert is_installed("wandb_of_runs")
