"""What tests ask of the machine: where that lacks they are skipped with the reason, and in CI they fail."""

from __future__ import annotations

import os
from typing import NoReturn

import pytest


def cannot_run(reason: str, sight: str) -> NoReturn:
    """Skip a test; or fail it in CI, so that a green build has seen all that there is to see.

    Args:
        reason: what lacks here.
        sight: what CI has to see.
    """
    if os.environ.get("CI", "") not in ("", "0", "false"):
        pytest.fail(f"CI has to see {sight}, but there is {reason}", pytrace=False)
    pytest.skip(reason)
