"""`scripts/judge-environments vla-eval`: counts of vla-eval beside our own.

`python -m tests.envs.judges.vla_eval PYTHON` runs the command of that Python's environment.
"""

import json
import subprocess
import sys
import urllib.request
from functools import partial
from pathlib import Path

import yaml

from tests.envs.judges.comparison import FIRST, compare
from tests.support.ports import free_port
from tests.support.waiting import wait_until

PROGRAM = Path(__file__).with_name("programs") / "vla_eval_server.py"


def main(python: str) -> int:
    """Judge, and return the exit status."""
    return compare("vla-eval", partial(_judge, python), lambda count: range(FIRST, FIRST + count))


def _judge(python: str, task: str, episodes: int, shown: Path, report: Path, folder: Path) -> list[bool]:
    port = free_port()
    benchmark = {
        "benchmark": "cellwright_vla_eval:Cellwright",
        "mode": "sync",
        "episodes_per_task": episodes,
        "params": {"tasks": [task], "seed": FIRST, "cameras": [], "python": sys.executable},
    }
    config = {"server": {"url": f"ws://127.0.0.1:{port}"}, "output_dir": str(folder), "benchmarks": [benchmark]}
    (folder / "config.yaml").write_text(yaml.safe_dump(config))
    served = [python, str(PROGRAM), str(shown), str(report), str(port)]
    with subprocess.Popen(served, stderr=subprocess.DEVNULL) as server:
        try:
            wait_until(lambda: _answers(port), "model server")
            command = [str(Path(python).with_name("vla-eval")), "run", "--no-docker", "-c", "config.yaml"]
            subprocess.run(command, check=True, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        finally:
            server.terminate()
    (file,) = folder.rglob("*_aggregate.json")
    (found,) = json.loads(file.read_text())["tasks"]
    metrics = [each["metrics"] for each in sorted(found["episodes"], key=lambda each: each["episode_id"])]
    assert found["mean_success"] == round(sum(each["success"] for each in metrics) / episodes, 4)
    return [each["success"] for each in metrics]


def _answers(port: int) -> bool:
    try:
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/health") as answer:
            return bool(answer.status == 200)
    except OSError:
        return False


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
