"""Test of the harness's page: it names each module."""

from pathlib import Path


def test_page_names_each_module() -> None:
    folder = Path(__file__).parent
    modules = {path.name for path in folder.glob("*.py")} - {path.name for path in folder.glob("test_*.py")}
    page = (folder / "README.md").read_text(encoding="utf-8")
    assert sorted(name for name in modules - {"__init__.py"} if f"`{name}`" not in page) == []
