"""A cell as MJCF, the engine's own format: one file, with meshes in it."""

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import mujoco

from cellwright.cell.model.build import cell_specification
from cellwright.config.trial.trial import Trial
from cellwright.util.errors import UsageError

_DIGITS = 17  # with which any number is read again as it was


def mjcf_text(trial: Trial) -> str:
    """Return the model of a trial's cell as the text of an MJCF file.

    The engine reads the same model from it, to the last bit. A run begins in its key frame `home`.

    Raises:
        DescriptionError: the engine refuses the cell.
        ModelFileError: a user-defined model that the engine cannot use.
        UsageError: this version of the engine cannot write numbers in full.
    """
    spec = cell_specification(trial)
    with _all_digits():
        text: str = spec.to_xml()
    return text


@contextmanager
def _all_digits() -> Iterator[None]:
    """Let the engine write numbers in full: it writes six digits, and only its library has a switch for that."""
    library = ctypes.CDLL(str(next(Path(mujoco.__file__).parent.glob("*mujoco.*"))))
    try:
        get, put = library._mjPRIVATE__get_xml_precision, library._mjPRIVATE__set_xml_precision
    except AttributeError:
        version = mujoco.mj_versionString()
        raise UsageError(f"mjcf: this engine writes six digits at most (got mujoco {version}); use 4.0.1") from None
    before = get()
    put(_DIGITS)
    try:
        yield
    finally:
        put(before)
