"""The example of the page on cameras reads a picture from each of its cells."""

import gc
from pathlib import Path

import pytest

from tests.docs.pages import blocks

PAGE = Path(__file__).parents[2] / "docs" / "cameras.md"


@pytest.mark.slow
def test_example_of_cameras_page_reads_pictures_of_two_cells(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    found = {each.language: each.body for each in reversed(blocks(PAGE))}
    (tmp_path / "cameras.yaml").write_text(found["yaml"])
    monkeypatch.chdir(tmp_path)
    exec(compile(found["python"], str(PAGE), "exec"), {})
    gc.collect()  # cells that are gone release the render process
    assert capsys.readouterr().out == "[(480, 640, 3), (480, 640, 3)]\n"
