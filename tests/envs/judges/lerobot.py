"""`scripts/judge-environments lerobot`: counts of lerobot-eval beside our own.

`python -m tests.envs.judges.lerobot PYTHON` runs the command of that Python's environment.
"""

import json
import os
import subprocess
import sys
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from tests.envs.judges.comparison import FIRST, compare
from tests.envs.judges.demonstrations import PICK

PROGRAM = Path(__file__).with_name("programs") / "lerobot_imitator.py"
ACT = {"type": "act", "pretrained_backbone_weights": "null", "device": "cpu", "push_to_hub": "false"}
"""A policy with random weights: it proves that pictures and chunks pass, and no more."""
_BATCH = 4


def main(python: str) -> int:
    """Judge, and return the exit status."""
    status = compare("lerobot-eval", partial(_judge, python), lambda count: range(FIRST, FIRST + count))
    return status | _act(python)


def _judge(python: str, task: str, episodes: int, shown: Path, report: Path, folder: Path) -> list[bool]:
    """Evaluate one environment at a time, and of the demonstrated task also several at once."""
    program = [python, str(PROGRAM), str(shown)]
    policy = {"type": "imitator", "device": "cpu", "push_to_hub": "false"}
    found = _evaluated([*program, str(report)], policy, {"task": task}, (episodes, 1), folder / "one")
    if task == PICK:
        other = [*program, str(folder / "other.json")]
        batched = _evaluated(other, policy, {"task": task}, (episodes, _BATCH), folder / "several")
        if _figures(found) != _figures(batched):
            print(
                f"DIFFERENT lerobot-eval: {task}: one at a time {_figures(found)}, {_BATCH} at once {_figures(batched)}"
            )
            return []
    return list(found["successes"])


def _act(python: str) -> int:
    """Let a network without training act upon pictures."""
    command = [str(Path(python).with_name("lerobot-eval"))]
    with TemporaryDirectory() as folder:
        found = _evaluated(command, ACT, {"task": PICK, "cameras": "overhead,wrist"}, (2, 2), Path(folder, "act"))
        videos = [Path(each).stat().st_size > 0 for each in found["videos"]]
    is_right = len(found["successes"]) == 2 and videos == [True, True]
    print(f"{'same     ' if is_right else 'DIFFERENT'} lerobot-eval: ACT with random weights: {found['successes']}")
    return 0 if is_right else 1


def _evaluated(
    command: list[str], policy: dict[str, str], env: dict[str, str], episodes: tuple[int, int], folder: Path
) -> dict[str, Any]:
    """Return what lerobot-eval reports; `episodes` is their number, and how many run at once."""
    options = {f"policy.{key}": value for key, value in policy.items()}
    options |= {"env.type": "cellwright", "env.python": sys.executable, **{f"env.{key}": env[key] for key in env}}
    count, batch = episodes
    options |= {"eval.n_episodes": str(count), "eval.batch_size": str(batch), "seed": str(FIRST)}
    options |= {"output_dir": str(folder)}
    ran = subprocess.run(
        [*command, *(f"--{key}={value}" for key, value in options.items())],
        env={**os.environ, "HF_HUB_OFFLINE": "1"},
        capture_output=True,
        text=True,
    )
    if ran.returncode:
        raise SystemExit(f"lerobot-eval: {ran.stderr[-4000:]}")
    (task,) = json.loads((folder / "eval_info.json").read_text())["per_task"]
    metrics = task["metrics"]
    return {"successes": metrics["successes"], "rewards": metrics["sum_rewards"], "videos": metrics["video_paths"]}


def _figures(found: dict[str, Any]) -> list[tuple[bool, float]]:
    """Return success and sum of the rewards of each episode; torch adds up in an order of its own."""
    return [(success, round(reward, 6)) for success, reward in zip(found["successes"], found["rewards"], strict=True)]


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
