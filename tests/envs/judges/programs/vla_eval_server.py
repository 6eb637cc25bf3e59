"""Model server of vla-eval with the imitator, in the interpreter of that judge.

`python vla_eval_server.py DEMONSTRATIONS REPORT PORT` serves, and writes what was seen.
"""

import json
import sys
from pathlib import Path
from typing import Any

from imitator import Imitator
from vla_eval.model_servers.predict import PredictModelServer
from vla_eval.model_servers.serve import serve
from vla_eval.specs import RAW, STATE_JOINT, DimSpec

DEMONSTRATIONS, REPORT, PORT = sys.argv[1:]


class Server(PredictModelServer):
    """The imitator as a model server."""

    def __init__(self) -> None:
        super().__init__()
        self._imitator = Imitator(DEMONSTRATIONS)

    def get_action_spec(self) -> dict[str, DimSpec]:
        return {"actions": RAW}

    def get_observation_spec(self) -> dict[str, DimSpec]:
        return {"state": STATE_JOINT}

    def get_observation_params(self) -> dict[str, Any]:
        return {"send_state": True, "privileged": True}

    def predict(self, obs: Any, ctx: Any) -> dict[str, Any]:
        return {"actions": self._imitator.act(obs["states"], obs["environment_state"], obs["task_description"])}

    async def on_episode_start(self, config: dict[str, Any], ctx: Any) -> None:
        await super().on_episode_start(config, ctx)
        self._imitator.begin()

    async def on_episode_end(self, result: dict[str, Any], ctx: Any) -> None:
        await super().on_episode_end(result, ctx)
        self._imitator.end()
        Path(REPORT).write_text(json.dumps(self._imitator.seen))


if __name__ == "__main__":
    serve(Server(), host="127.0.0.1", port=int(PORT))
