"""Environment of a cell: Gymnasium's own checks, episodes by seed, options, snapshots, ends and faults."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env, data_equivalence

from cellwright import load_robot, load_trial
from cellwright.config.robot.model import link_poses
from cellwright.config.trial.catalogue import bundled_tasks
from cellwright.config.trial.task import Held
from cellwright.config.trial.trial import Trial
from cellwright.envs.cell_env import CellEnv
from cellwright.envs.registration import environment_id
from cellwright.rendering.scene import Scene
from cellwright.util.errors import UnknownNameError, UsageError
from tests.cell.devices.workers import FakeWorker

TASK = "pick_from_bin"


@pytest.fixture(name="env")
def made_env() -> Iterator[CellEnv]:
    env = CellEnv(TASK)
    yield env
    env.close()


def actions_around(first: Any, count: int) -> list[Any]:
    generator = np.random.default_rng(3)
    return [first + generator.uniform(-0.05, 0.05, first.shape).astype(np.float32) for _ in range(count)]


def episode(env: CellEnv, seed: int | None, count: int = 8, **options: Any) -> list[Any]:
    """Return all that an episode of some steps tells."""
    observation, info = env.reset(seed=seed, options=options)
    return [(observation, info), *(env.step(action) for action in actions_around(observation["agent_pos"], count))]


@pytest.mark.parametrize("task", bundled_tasks())
@pytest.mark.parametrize("control", ["absolute", "delta"])
def test_gymnasium_finds_no_fault_with_a_bundled_task(task: str, control: str) -> None:
    env = gymnasium.make(f"cellwright.envs:{environment_id(task)}", control=control)
    with warnings.catch_warnings():
        # it recommends ±1 for all actions, and absolute ones are in rad and m
        warnings.filterwarnings("ignore", message=".*symmetric and normalized.*")
        check_env(env.unwrapped, skip_render_check=True)
    env.close()
    env.close()


def test_gymnasium_finds_no_fault_with_pictures() -> None:
    env = gymnasium.make(
        f"cellwright.envs:{environment_id(TASK)}", control="delta", cameras=("overhead",), render_mode="rgb_array"
    )
    check_env(env.unwrapped)
    env.reset(seed=1)
    assert np.asarray(env.render()).shape == (480, 640, 3)
    env.close()


def test_closed_environment_without_cameras_ends_the_process_that_rendered_it() -> None:
    env = CellEnv(replace(load_trial(TASK), sensors=()), render_mode="rgb_array")
    env.reset(seed=1)
    service, workers = env.stepper.cell.render_service, list[FakeWorker]()

    def start(scene: Scene) -> FakeWorker:
        workers.append(FakeWorker(scene))
        return workers[-1]

    service._start = start
    assert env.render() is not None
    env.close()
    assert [each.is_closed for each in workers] == [True]


def test_what_a_learner_reads_beside_the_steps(env: CellEnv) -> None:
    assert env.task == TASK
    assert env.task_description == "Pick up a gear from the bin."
    assert env._max_episode_steps == 400  # 20 s at 20 Hz
    assert env.metadata["render_fps"] == 20.0
    assert "stepper" not in env.__dict__  # spaces need no cell: vectors make an environment for them alone
    assert env.action_space.shape == (len(env.agent_pos_names),)
    observation, info = env.reset(seed=0)
    assert observation["environment_state"].shape == (len(env.environment_state_names),)
    assert info["is_success"] is False
    assert info["time"] == 0.0


def test_a_seed_is_an_episode_bit_for_bit(env: CellEnv) -> None:
    first, second, other = episode(env, 5), episode(env, 6), episode(CellEnv(TASK), 5)
    assert data_equivalence(first, episode(env, 5), exact=True)
    assert data_equivalence(first, other, exact=True)
    assert not data_equivalence(first, second, exact=True)


def test_episodes_without_a_seed_follow_from_the_seed_before(env: CellEnv) -> None:
    env.reset(seed=5)
    following = [episode(env, None, 1) for _ in range(2)]
    env.reset(seed=5)
    assert data_equivalence(following, [episode(env, None, 1) for _ in range(2)], exact=True)
    assert not data_equivalence(following[0], following[1], exact=True)


def test_variation_follows_the_option(env: CellEnv) -> None:
    def places(seed: int, **options: Any) -> Any:
        env.reset(seed=seed, options=options)
        return [env.stepper.cell.parts.pose(each) for each in env.stepper.cell.parts.all]

    assert places(1) != places(2)
    assert places(1, variation=False) == places(2, variation=False)
    assert places(1) == places(1, variation=True)


def test_joints_follow_the_option_for_one_episode(env: CellEnv) -> None:
    usual, _ = env.reset(seed=1)
    moved, _ = env.reset(seed=1, options={"joints": {"elbow_joint": 1.2}})
    place = env.agent_pos_names.index("elbow_joint")
    assert moved["agent_pos"][place] == pytest.approx(1.2)
    assert data_equivalence(env.reset(seed=1)[0], usual, exact=True)
    with pytest.raises(UnknownNameError, match="elbow_joint"):
        env.reset(options={"joints": {"elbo_joint": 1.2}})


def test_unknown_options_are_ignored(env: CellEnv) -> None:
    assert data_equivalence(episode(env, 1, 2), episode(env, 1, 2, lerobot_new_rollout=True), exact=True)


def test_an_episode_goes_on_from_a_snapshot_bit_for_bit(env: CellEnv) -> None:
    observation, _ = env.reset(seed=4)
    actions = actions_around(observation["agent_pos"], 10)
    for action in actions[:5]:
        env.step(action)
    snapshot, ahead = env.snapshot(), [env.step(action) for action in actions[5:]]
    env.reset(seed=9)
    at_once = env.reset(options={"snapshot": snapshot})
    assert data_equivalence(ahead, [env.step(action) for action in actions[5:]], exact=True)
    assert at_once[1]["time"] == pytest.approx(0.25)
    with pytest.raises(UsageError, match=r"snapshot: must be one of `CellEnv.snapshot` \(got str\)"):
        env.reset(options={"snapshot": "yesterday"})


def test_delta_actions_of_zero_hold_the_arm_still() -> None:
    env = CellEnv(TASK, control="delta")
    observation, _ = env.reset(seed=1)
    desired = env.stepper.desired()
    for _ in range(20):
        later, *_ = env.step(np.zeros(8))
    assert env.stepper.desired() == desired
    assert later["agent_pos"] == pytest.approx(observation["agent_pos"], abs=0.01)


def test_episode_is_truncated_at_the_time_limit() -> None:
    env = CellEnv(replace(load_trial(TASK), time_limit=0.2))
    observation, _ = env.reset(seed=1)
    ends = [env.step(observation["agent_pos"])[2:4] for _ in range(4)]
    assert ends == [(False, False)] * 3 + [(False, True)]


def test_episode_is_terminated_by_success_with_its_reward() -> None:
    env = CellEnv(easy(load_trial(TASK)))
    observation, info = env.reset(seed=1)
    assert info["is_success"] is True
    _, reward, terminated, truncated, info = env.step(observation["agent_pos"])
    assert (reward, terminated, truncated, info["is_success"]) == (1.0, True, False, True)


def easy(trial: Trial) -> Trial:
    """Return the trial with a task that is done from the beginning: its cup holds the part."""
    assert trial.task is not None
    start = replace(trial.task.start, holding="gear_part")
    return replace(trial, task=replace(trial.task, success=(Held("gear_part"),), start=start))


def test_a_competition_that_ends_early_ends_the_episode_without_success(env: CellEnv) -> None:
    observation, _ = env.reset(seed=1)
    env.step(observation["agent_pos"])
    env.stepper.cell.competition.end()
    _, _, terminated, truncated, info = env.step(observation["agent_pos"])
    assert (terminated, truncated, info["is_success"]) == (True, False, False)


def test_wrong_arguments_are_refused() -> None:
    lesson = load_trial("lesson")
    with pytest.raises(UsageError, match="trial lesson: there is no task; add a section `task` to its file"):
        CellEnv(lesson)
    with pytest.raises(UsageError, match="an episode needs a time limit"):
        CellEnv(replace(load_trial(TASK), time_limit=None))
    with pytest.raises(UsageError, match=r"control: must be absolute or delta \(got 'detla'\); did you mean delta"):
        CellEnv(TASK, control="detla")  # type: ignore[arg-type]
    with pytest.raises(UsageError, match="render_mode: must be rgb_array or None"):
        CellEnv(TASK, render_mode="human")
    with pytest.raises(UsageError, match="whole ticks of 2 ms"):
        CellEnv(TASK, rate=30)
    with pytest.raises(UnknownNameError, match="overhead"):
        CellEnv(TASK, cameras=("overhaed",))


def test_steps_before_a_reset_and_wrong_actions_are_refused(env: CellEnv) -> None:
    with pytest.raises(UsageError, match="call reset first"):
        env.step(np.zeros(8))
    env.reset(seed=1)
    with pytest.raises(UsageError, match="action: must have 8 numbers"):
        env.step(np.zeros(7))
    with pytest.raises(UsageError, match="must be finite"):
        env.step(np.full(8, np.nan))
    assert env.info()["time"] == 0.0


REACH = """
cell:
  robots:
    tandem: {model: tandem, at: [0.0, 0.0, 0.0], namespace: left}
  arms:
    arm: {mount: {kind: rail, at: [0.0, 3.0, 0.9]}}
  bins: {bin1: {at: [0.8, 0.0], size: [0.4, 0.4], surface: 0.5}}
time_limit: 1
task:
  sentence: Reach the point.
  success: {link_at: {robot: tandem, link: LINK, at: PLACE, tolerance: 1.0}}
"""
"""A robot beside an arm, with a task that is done from the beginning."""


def test_a_described_cell_with_a_robot_and_an_arm_is_an_environment(tmp_path: Path) -> None:
    robot = load_robot("tandem").robot
    link = [*robot.links][-1]
    place = [round(value, 2) for value in link_poses(robot, {})[link].position]
    (tmp_path / "reach.yaml").write_text(REACH.replace("LINK", link).replace("PLACE", str(place)))
    env = CellEnv(tmp_path / "reach.yaml", control="delta")
    with closing(env):
        check_env(env, skip_render_check=True)
        names = env.agent_pos_names
        first = next(number for number, name in enumerate(names) if name.startswith("tandem/"))
        assert names[first - 1] == "suction"
        before, _ = env.reset(seed=1)
        action = np.zeros(len(names))
        action[first] = 1.0 if before["agent_pos"][first] <= 0.0 else -1.0
        after, reward, terminated, _, _ = env.step(action)
        assert (reward, terminated) == (1.0, True)
        assert env.stepper.space.channels[first].unit == "m"  # and 0.5 m/s for a period of 0.05 s
        moved = env.stepper.desired()[first] - float(before["agent_pos"][first])
        assert moved == pytest.approx(0.025 * action[first], abs=1e-3)
        assert np.abs(after["agent_pos"] - before["agent_pos"]).argmax() == first
