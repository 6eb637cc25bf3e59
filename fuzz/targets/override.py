"""Values of `--set` and `--sweep`, an override a line: each applies to a trial, or is refused with its option."""

from __future__ import annotations

import json
from collections.abc import Iterator

from cellwright.config.parsing.overrides import Override, read_values
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial, resolved
from cellwright.util.errors import DescriptionError, UsageError
from fuzz.targets import trial_text
from fuzz.values import TEXTS
from fuzz.verdict import FindingError, check_lines, check_refusal

MAX_SIZE = 2000
WORDS = (
    *trial_text.WORDS,
    *("options.", "orders.order_0.parts.part_1.pose", "models_over_bins.bin7.models", "belt_parts.gear_part.6.0."),
    *("cellwright.arm.gains.elbow_joint", ".xyz[0]=", "[1]", "=[", "={", "=", ".", "\n", "[0, 1]", "{type: gear_part}"),
)
_OPTION = "--set"
_TRIAL = find_trial("lesson")


def seeds() -> Iterator[bytes]:
    """Yield overrides that a trial takes, and some that it refuses."""
    yield b"time_limit=60\noptions.belt_population_cycles=3"
    yield b"orders.order_0.parts.part_1.pose.xyz[0]=0.1\ncellwright.arm.gains={elbow_joint: {p: 1, d: 2}}"
    yield b"belt_parts.gear_part.6.0.pose.xyz=[0, 0, 0.2]\nsensors.b={type: break_beam, pose: {}}"
    yield b"options.x.y=1\nfaulty_parts[0]=a\nmodels_over_bins.bin7.xyz=&a [1, 2, 3]"
    for text in TEXTS:
        yield b"time_limit=" + text.encode("utf-8", "replace")


def attempt(data: bytes) -> None:
    """Load a trial with all lines as overrides, and read each as values of a sweep."""
    lines = data.decode("utf-8", "replace").splitlines()
    overrides = []
    for line in lines:
        try:
            overrides.append(Override.read(line, _OPTION))
            read_values(_OPTION, line.partition("=")[2])
        except UsageError as error:
            check_lines([error], [_OPTION])
    try:
        loaded = load_trial([_TRIAL], overrides=overrides)
    except DescriptionError as error:
        check_refusal(error, _OPTION, str(_TRIAL))
        return
    if any(str(warning).startswith(_OPTION) for warning in loaded.warnings):
        raise FindingError("an override with a warning was taken")
    json.dumps(resolved(loaded), allow_nan=False)
