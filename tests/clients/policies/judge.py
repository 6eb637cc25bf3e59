"""`scripts/judge-policies`: the wires of policy servers, judged by the reference packages in another interpreter.

`python -m tests.clients.policies.judge PYTHON` prints a line for each judgement, and exits with 1 if one differs.
"""

import json
import subprocess
import sys
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from cellwright.clients.policies.openpi import OpenpiPolicy
from cellwright.clients.policies.policy import PolicyAnswerError, PolicyConnectionError
from tests.support.ports import free_port
from tests.support.waiting import wait_until

REFERENCE = Path(__file__).with_name("reference.py")
DATA = Path(__file__).parents[2] / "data"


def main(python: str) -> int:
    """Judge, and return the exit status."""
    same = [
        _same_as_reference(python, "bytes", "policy_wire_cases.json", "bytes"),
        _same_as_reference(python, "pictures", "resized_pictures_cases.json", "sha256"),
        _reported("openpi-server 0.1.0", lambda: _ask_server(python)),
    ]
    return 0 if all(same) else 1


def _reported(what: str, judge: Callable[[], None]) -> bool:
    try:
        judge()
    except (AssertionError, pytest.fail.Exception) as error:
        print(f"DIFFERENT {what}: {error}")
        return False
    print(f"same      {what}")
    return True


def _same_as_reference(python: str, action: str, name: str, key: str) -> bool:
    """Compare what the reference makes of the cases with what they have; our own tests hold us to the same cases."""
    cases = json.loads((DATA / name).read_text())["cases"]
    done = subprocess.run(
        [python, str(REFERENCE), action, str(DATA / name)], capture_output=True, text=True, check=True
    )
    found = done.stdout.split()
    assert len(found) == len(cases)

    def compare() -> None:
        wrong = [case["name"] for case, each in zip(cases, found, strict=True) if case[key] != each]
        assert not wrong, ", ".join(wrong)

    return _reported(f"{len(cases)} cases of {name}", compare)


def _ask_server(python: str) -> None:
    """Ask the reference server, make it fail, and ask it again in the next episode."""
    port = free_port()
    with subprocess.Popen([python, str(REFERENCE), "serve", str(port)], stderr=subprocess.DEVNULL) as server:
        try:
            policy = wait_until(lambda: _connected(port), "reference server")
            assert policy is not None
            with closing(policy):
                assert policy.metadata == {"judge": True}
                state, picture = np.arange(8, dtype=np.float32), np.ones((1080, 1920, 3), np.uint8)
                for number in (1, 2):
                    policy.reset(number, "pick")
                    answer = policy.infer({"state": state, "picture": picture, "prompt": "pick"})
                    assert answer.actions.tolist() == [state.tolist()] * 10
                    assert answer.extras["sum"] == picture.size
                    assert answer.infer_ms is not None
                    _refused(policy)
        finally:
            server.terminate()


def _refused(policy: OpenpiPolicy) -> None:
    with pytest.raises(PolicyAnswerError, match="KeyError: 'state'"):
        policy.infer({})


def _connected(port: int) -> OpenpiPolicy | None:
    try:
        return OpenpiPolicy(f"ws://127.0.0.1:{port}")
    except PolicyConnectionError:
        return None


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
