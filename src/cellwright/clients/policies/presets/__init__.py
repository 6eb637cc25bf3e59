"""Bundled key maps, for policies of common robots, by their names."""

from pathlib import Path

from cellwright.util.errors import UnknownNameError

_FOLDER = Path(__file__).parent
_SUFFIX = ".yaml"


def preset_names() -> list[str]:
    """Return the names of the presets.

    Example:
        >>> preset_names()
        ['aloha', 'droid', 'libero']
    """
    return sorted(path.stem for path in _FOLDER.glob(f"*{_SUFFIX}"))


def map_path(name_or_path: str) -> Path:
    """Return the file of a key map: an existing file, or anything that names one; else the preset of that name.

    Raises:
        UnknownNameError: there is no such preset.
    """
    path, names = Path(name_or_path), preset_names()
    if path.is_file() or path.suffix or len(path.parts) > 1:
        return path
    if name_or_path in names:
        return _FOLDER / f"{name_or_path}{_SUFFIX}"
    raise UnknownNameError("policy map", name_or_path, names)
