"""A cell as MJCF, the engine's own format: one file, with meshes in it."""

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import mujoco

from cellwright.cell.model.build import cell_specification
from cellwright.config.trial.trial import Trial

_DIGITS = 17  # with which any number is read again as it was


def mjcf_text(trial: Trial) -> str:
    """Return the model of a trial's cell as the text of an MJCF file.

    The engine reads the same model from it, to the last bit. A run begins in its key frame `home`.

    Raises:
        DescriptionError: the engine refuses the cell.
        ModelFileError: a user-defined model that the engine cannot use.
    """
    spec = cell_specification(trial)
    with _all_digits():
        text: str = spec.to_xml()
    return text


@contextmanager
def _all_digits() -> Iterator[None]:
    """Let the engine write numbers in full; it writes six digits by default, and has a switch in its library alone."""
    library = ctypes.CDLL(str(next(Path(mujoco.__file__).parent.glob("libmujoco*"))))
    before = library._mjPRIVATE__get_xml_precision()
    library._mjPRIVATE__set_xml_precision(_DIGITS)
    try:
        yield
    finally:
        library._mjPRIVATE__set_xml_precision(before)
