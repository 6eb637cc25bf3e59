"""Program of a test: an episode by the client alone, with NumPy and websockets; prints it as JSON, and dies."""

import json
import os
import sys

python, *sys.path[:0] = sys.argv[1:]

from cellwright_env import RemoteEnv  # noqa: E402  # found there

if __name__ == "__main__":
    env = RemoteEnv("pick_from_bin", python=python)
    assert env._process is not None
    action = env.reset(seed=5)[0]["agent_pos"]
    observation, reward, terminated, truncated, info = env.step(action)
    loaded = sorted({name.partition(".")[0] for name in sys.modules} & {"cellwright", "mujoco", "gymnasium", "msgspec"})
    reported = [observation["environment_state"].tolist(), reward, terminated, truncated, info]
    print(json.dumps({"reported": reported, "loaded": loaded, "server": env._process.pid}), flush=True)
    os._exit(1)
