"""The trials that come with Cellwright, by name."""

from importlib.resources import files
from pathlib import Path

from cellwright.errors import UnknownNameError

_SUFFIX = ".yaml"
_FOLDER = Path(str(files("cellwright.description"))) / "catalogue"


def bundled() -> list[str]:
    """The names of the bundled trials."""
    return sorted(path.stem for path in _FOLDER.glob(f"*{_SUFFIX}"))


def find_trial(name_or_path: str | Path) -> Path:
    """The file that is meant: a path to one that exists, else the bundled trial of that name.

    Raises:
        UnknownNameError: neither.
    """
    path = Path(name_or_path)
    if path.is_file():
        return path
    name = str(name_or_path)
    if name in bundled():
        return _FOLDER / f"{name}{_SUFFIX}"
    raise UnknownNameError("trial", name, bundled())
