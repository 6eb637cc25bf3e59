"""Dialects of OpenPI's websocket."""

import pytest

from cellwright.clients.policies.dialects import DIALECTS, check_reset, detected_dialect, reported_error
from cellwright.clients.policies.policy import PolicyAnswerError

ROBOARENA = {"image_resolution": None, "n_external_cameras": 2, "action_space": "joint_velocity"}


@pytest.mark.parametrize(
    ("metadata", "name"),
    [
        ({}, "openpi"),
        ({"reset_pose": [0, -1.5, 1.5, 0, 0, 0]}, "openpi"),
        ({"model_name": "x"}, "lebedov"),
        (ROBOARENA, "roboarena"),
        (ROBOARENA | {"action_keys": ["eef_9d"]}, "vllm"),
        (ROBOARENA | {"default_action_horizon": 16}, "vllm"),
    ],
)
def test_first_frame_shows_the_dialect(metadata: dict[str, object], name: str) -> None:
    assert detected_dialect(metadata) is DIALECTS[name]


@pytest.mark.parametrize("reply", ["reset successful", {"status": "reset successful"}])
def test_reset_is_confirmed_by_text_or_map(reply: object) -> None:
    check_reset(reply)


@pytest.mark.parametrize("reply", ["Traceback (most recent call last):\n", "", {"status": 1}, {}, [1], "no reset"])
def test_anything_else_confirms_no_reset(reply: object) -> None:
    with pytest.raises(PolicyAnswerError, match="the reset was not confirmed"):
        check_reset(reply)


def test_only_a_map_of_type_error_reports_one() -> None:
    assert reported_error({"type": "error", "message": "no model"}) == "no model"
    assert reported_error({"type": "error"}) == "no reason given"
    assert reported_error({"type": "actions"}) is None
    assert reported_error([1]) is None
