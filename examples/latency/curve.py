"""Draw the success of the policy of picker.py against its latency, at three speeds of the belt: `python curve.py`.

It serves the policy, evaluates it with `cellwright eval`, and writes latency.svg. Run again with more seeds, as by
`python curve.py 20`, it goes on from the results in the folder `curve`; remove that after a change of the policy.
"""

import json
import subprocess
import sys
from pathlib import Path
from threading import Thread

import matplotlib.pyplot as plt
import numpy as np
from picker import TOP, answer
from websockets.sync.server import serve

import cellwright

HERE, FOLDER, PORT = Path(__file__).parent, Path("curve"), 8000
LATENCIES, SPEEDS = (0, 60, 120, 240), (0.1, 0.25, 0.4)
"""Latencies [ms], and speeds of the belt [m/s]."""
SPEED, GEAR, CUP = "cell.belts.belt.speed", "populate_conveyor|gear_part_clone_0", "vacuum_gripper_link"
LOW = TOP + 0.02
"""Height of the cup [m] at which it has come down to the gear."""


def evaluate(seeds):
    """Run every latency at every speed, the policy behind a websocket, and return the summary."""
    command = [sys.executable, "-m", "cellwright", "eval", str(HERE / "belt.yaml"), "--vary", "--seeds", seeds]
    command += ["--policy", f"ws://127.0.0.1:{PORT}", "--policy-map", str(HERE / "map.yaml"), "--record"]
    command += [word for each in LATENCIES for word in ("--latency", f"{each}ms")]
    command += ["--sweep", f"{SPEED}={','.join(map(str, SPEEDS))}", "--out", str(FOLDER)]
    with serve(answer, "127.0.0.1", PORT, compression=None) as server:
        Thread(target=server.serve_forever, daemon=True).start()
        status = subprocess.run(command, check=False).returncode  # noqa: S603
    if status not in (0, 1):  # 1: some runs have failed, as they should
        sys.exit(status)
    return json.loads((FOLDER / "summary.json").read_text())


def miss(key):
    """Return how far along the belt the cup is behind the gear [m], as it has come down to it."""
    (path,) = (FOLDER / "recordings").glob(f"*-{key[:8]}.mcap")
    with cellwright.open_recording(path) as recording:
        cup, gear = (recording.path(body)[1] for body in (CUP, GEAR))
    down = np.argmax(cup[:, 2] < LOW)
    return cup[down, 1] - gear[down, 1]


def draw(summary):
    """Draw a line for each speed: the rate of success with its interval, and the mean miss."""
    figure, (rates, misses) = plt.subplots(1, 2, figsize=(9.0, 3.6), layout="constrained")
    for place, speed in enumerate(SPEEDS):
        trials = [each for each in summary["trials"] if each["overrides"][SPEED] == str(speed)]
        trials.sort(key=lambda each: float(each["overrides"]["latency_ms"]))
        rate = np.array([each["passed"] / each["runs"] for each in trials])
        ends = np.array([each["passed_interval"] or (0.0, 1.0) for each in trials])
        at = [latency + 3 * (place - 1) for latency in LATENCIES]  # beside each other
        bars = np.abs(ends.T - rate)
        rates.errorbar(at, rate, bars, marker="o", capsize=3, label=f"{speed} m/s")
        names = [each["trial"] for each in trials]
        found = [[miss(run["key"]) for run in summary["results"] if run["trial"] == name] for name in names]
        mean = [1000.0 * np.mean(each) for each in found]
        misses.plot(LATENCIES, mean, marker="o")
        figures = ", ".join(f"{100 * one:.0f} % and {other:.0f} mm" for one, other in zip(rate, mean))
        sys.stdout.write(f"{speed} m/s: {figures}\n")
    rates.set(ylabel="rate of success", ylim=(-0.05, 1.05))
    misses.set(ylabel="cup behind the gear [mm]", ylim=(0, None))
    for axes in (rates, misses):
        axes.set(xlabel="latency [ms]", xticks=LATENCIES)
        axes.grid(visible=True, alpha=0.3)
    figure.legend(title="belt", frameon=False, loc="outside right center")
    plt.rcParams["svg.hashsalt"] = "cellwright"
    figure.savefig("latency.svg", metadata={"Date": None})


if __name__ == "__main__":
    draw(evaluate(sys.argv[1] if len(sys.argv) > 1 else "5"))
