"""The documentation as a site: it builds, links lead somewhere, and nothing in it comes from elsewhere."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import cellwright
from tests.support.waiting import TIMEOUT

ROOT = Path(__file__).parents[2]


def build(configuration: Path, site: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "mkdocs", "build", "--config-file", str(configuration), "--site-dir", str(site)]
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    return subprocess.run(
        command,
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
        encoding="utf-8",
        check=False,
    )


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    built = build(ROOT / "mkdocs.yml", folder)
    assert built.returncode == 0, built.stderr
    return folder


@pytest.mark.slow
def test_site_has_every_page(site: Path) -> None:
    pages = {path.relative_to(ROOT / "docs").with_suffix(".html") for path in (ROOT / "docs").rglob("*.md")}
    made = {path.relative_to(site) for path in site.rglob("*.html")}
    joined = {Path("index.html"), Path("contributing.html"), Path("changelog.html"), Path("404.html")}
    assert made == pages | joined
    assert (site / "images" / "cell.png").is_file()


def test_site_loads_nothing_from_network(site: Path) -> None:
    for page in site.rglob("*.html"):
        text = page.read_text(encoding="utf-8")
        assert not re.findall(r'<(?:script|img|iframe)[^>]*\ssrc="?https?://[^"> ]*', text)
        assert not re.findall(r'<link[^>]*rel="?(?:stylesheet|preconnect|preload)[^>]*https?://', text)


def test_link_out_of_docs_folder_is_redirected(site: Path) -> None:
    page = (site / "adapt-a-robot.html").read_text(encoding="utf-8")
    assert 'href="index.html#two-commands"' in page
    assert 'href="../' not in page
    start = (site / "index.html").read_text(encoding="utf-8")
    assert 'href="getting-started.html"' in start
    assert 'href="changelog.html"' in start
    assert 'src="images/cell.png"' in start


def test_block_of_file_shows_file_name(site: Path) -> None:
    page = (site / "how-to" / "add-a-sensor.html").read_text(encoding="utf-8")
    names = re.findall(r'<span class="filename">([^<]*)</span>', page)
    assert names == ["level.py", "pyproject.toml", "with_level.yaml"]


def test_reference_has_all_public_names(site: Path) -> None:
    page = (site / "api.html").read_text(encoding="utf-8")
    anchors = {anchor.rpartition(".")[2] for anchor in re.findall(r'id="(cellwright\.[\w.]+)"', page)}
    assert set(cellwright.__all__) - {"__version__", "errors"} <= anchors  # errors: the module, whose classes are there


def test_build_with_broken_link_fails(tmp_path: Path) -> None:
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs" / "index.md").write_text("# Here\n\n[there](there.md), [below](#below)\n")
    shutil.copy(ROOT / "mkdocs.yml", tmp_path / "mkdocs.yml")
    whole = (tmp_path / "mkdocs.yml").read_text()
    kept = re.search(r"^validation:\n(?:  .*\n)+", whole, re.MULTILINE)
    assert kept is not None
    (tmp_path / "mkdocs.yml").write_text(f"site_name: test\nstrict: true\n{kept[0]}")
    built = build(tmp_path / "mkdocs.yml", tmp_path / "site")
    assert built.returncode != 0
    assert "there.md" in built.stderr
    assert "#below" in built.stderr
