"""`lerobot-eval` with the imitator as its policy `imitator`, in the interpreter of that judge.

`python lerobot_imitator.py DEMONSTRATIONS REPORT ARGUMENT …` runs the command, and writes what the policy saw as JSON.
"""

import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import torch
from cellwright_env import RemoteEnv
from imitator import Imitator
from lerobot.configs.policies import PreTrainedConfig
from lerobot.policies.pretrained import PreTrainedPolicy
from lerobot.processor import PolicyProcessorPipeline
from lerobot.processor.converters import policy_action_to_transition, transition_to_policy_action
from lerobot.scripts.lerobot_eval import main

DEMONSTRATIONS, REPORT, *ARGUMENTS = sys.argv[1:]
IMITATORS: list[Imitator] = []
"""One for each environment of a batch."""


@PreTrainedConfig.register_subclass("imitator")
@dataclass
class ImitatorConfig(PreTrainedConfig):
    """Configuration of a policy that is not trained."""

    observation_delta_indices = action_delta_indices = reward_delta_indices = None

    def get_optimizer_preset(self) -> Any:
        raise NotImplementedError

    def get_scheduler_preset(self) -> Any:
        raise NotImplementedError

    def validate_features(self) -> None:
        assert sorted(self.input_features) == ["observation.environment_state", "observation.state"]
        assert [*self.output_features] == ["action"]


class ImitatorPolicy(PreTrainedPolicy):
    """The imitator as a policy; LeRobot finds it by its name, beside the configuration."""

    config_class, name = ImitatorConfig, "imitator"

    def reset(self) -> None:
        for each in IMITATORS:
            each.begin()

    def select_action(self, batch: dict[str, Any], **_: Any) -> Any:
        states, others, sentences = batch["observation.state"], batch["observation.environment_state"], batch["task"]
        while len(IMITATORS) < len(states):
            IMITATORS.append(Imitator(DEMONSTRATIONS))
        rows = zip(IMITATORS, states.numpy(), others.numpy(), sentences, strict=True)
        return torch.from_numpy(np.stack([imitator.act(*observed) for imitator, *observed in rows]))

    def predict_action_chunk(self, batch: dict[str, Any], **_: Any) -> Any:
        raise NotImplementedError

    def forward(self, batch: dict[str, Any]) -> Any:
        raise NotImplementedError

    def get_optim_params(self) -> Any:
        raise NotImplementedError


def make_imitator_pre_post_processors(config: ImitatorConfig, dataset_stats: Any = None) -> tuple[Any, Any]:
    """Return the steps before and after the policy: none. LeRobot finds this function by its name, too."""
    after = {"to_transition": policy_action_to_transition, "to_output": transition_to_policy_action}
    return PolicyProcessorPipeline(steps=[]), PolicyProcessorPipeline(steps=[], **after)


if __name__ == "__main__":
    sys.argv = ["lerobot-eval", *ARGUMENTS]
    with patch.object(RemoteEnv, "render", lambda env: np.zeros((64, 64, 3), np.uint8)):  # ACT is judged with pictures
        main()
    for each in IMITATORS:
        each.end()
    Path(REPORT).write_text(json.dumps([seen for each in IMITATORS for seen in each.seen]))
