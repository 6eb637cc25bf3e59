"""Bundled policies: one holds, one is random."""

import numpy as np
import pytest

from cellwright import load_trial
from cellwright.clients.policies.baselines import Hold, Random
from cellwright.config.control import ControlSpace
from cellwright.util.errors import UsageError


@pytest.fixture(scope="module")
def space() -> ControlSpace:
    return ControlSpace.of(load_trial("lesson"))


def test_hold_answers_with_the_state_in_its_ranges(space: ControlSpace) -> None:
    state = np.array([9.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 1.0], np.float32)
    assert Hold(space).infer({"state": state}).tolist() == [space.targets(state.tolist())]


@pytest.mark.parametrize(
    ("observation", "got"),
    [({}, "got none"), ({"state": np.zeros(3)}, r"got shape \(3,\)"), ({"state": ["a"] * 8}, r"got shape \(8,\)")],
)
def test_hold_needs_the_state(space: ControlSpace, observation: dict[str, object], got: str) -> None:
    with pytest.raises(UsageError, match=rf"observation: the policy hold needs state with 8 numbers.*{got}"):
        Hold(space).infer(observation)


def test_random_targets_depend_on_the_seed_alone(space: ControlSpace) -> None:
    policy = Random(space)

    def episode(seed: int) -> list[list[float]]:
        policy.reset(seed, "")
        return [policy.infer({})[0].tolist() for _ in range(50)]

    first = episode(1)
    assert episode(2) != first
    assert episode(1) == first
    for values in first:
        assert space.targets(values) == values
    spread = np.ptp(np.array(first), axis=0) / [channel.high - channel.low for channel in space.channels]
    assert (spread > 0.7).all()  # of 50 draws; less has a probability of 1e-6
