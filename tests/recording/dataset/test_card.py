"""Tests of the card of a data set."""

import yaml

from cellwright.recording.dataset.card import card
from tests.recording.dataset.sets import made


def test_card_has_a_head_in_yaml_for_the_hub() -> None:
    head = yaml.safe_load(card([made(0), made(1)]).split("---")[1])
    assert head["tags"] == ["LeRobot"]
    assert head["task_categories"] == ["robotics"]
    assert head["configs"] == [{"config_name": "default", "data_files": "data/*/*.parquet"}]


def test_card_names_recording_and_success_of_each_episode() -> None:
    text = card([made(0), made(1, sentence="Left|right")])
    assert "| 0 | 12 | yes | run0.mcap | Pick the gear. |\n" in text
    assert "| 1 | 9 | no | run1.mcap | Left\\|right |\n" in text
    assert "| episodes | 2, 1 of them succeeded |" in text
