"""Answers in the version of a package that this Python has: numbers that it does not name are not sent.

The cell answers in the newest version 1 of `simulation_interfaces`. A distribution may have any version from 1.0.0 on.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

INCORRECT_STATE, FAILED, LAST_COMMON = 3, 4, 100
"""Codes of `simulation_interfaces/Result`; those above the last belong to one service."""


def in_version(response: Any, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of an answer for a response.

    - Features that the package does not name are left out.
    - A code that the service does not name becomes OPERATION_FAILED.
    - A state of the simulation that the package does not name becomes INCORRECT_STATE, with the reason.
    """
    found = dict(values)
    result = found.get("result")
    if isinstance(result, dict) and result["result"] > LAST_COMMON and result["result"] not in _numbers(response):
        found["result"] = {**result, "result": FAILED}
    features = found.get("features")
    if isinstance(features, dict):
        known = _numbers(response.features)
        found["features"] = {**features, "features": [each for each in features["features"] if each in known]}
    state = found.get("state")
    if isinstance(state, dict) and "state" in state and state["state"] not in _numbers(response.state):
        reason = f"state {state['state']} is not in this version of the package; ask again when there is a world"
        found |= {"state": {}, "result": {"result": INCORRECT_STATE, "error_message": reason}}
    return found


def _numbers(message: Any) -> set[int]:
    """Return the values of the constants of a message's class."""
    constants = vars(type(message)).items()
    return {value for name, value in constants if name.isupper() and isinstance(value, int)}
