"""Tests of the description of a data set."""

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.recording.dataset.described import Feature, read_description
from cellwright.recording.dataset.layout import FRAME_COLUMNS, INFO

FEATURES: dict[str, Any] = {
    **{name: {"dtype": dtype, "shape": [1], "names": None} for name, dtype in FRAME_COLUMNS.items()},
    "action": {"dtype": "float32", "shape": [2], "names": ["x", "y"]},
    "observation.images.top": {"dtype": "video", "shape": [64, 96, 3], "names": ["height", "width", "channels"]},
}
VALUES = {"codebase_version": "v3.0", "fps": 20, "total_episodes": 2, "total_frames": 21, "total_tasks": 1}


def read(folder: Path, value: Any) -> tuple[Any, list[str]]:
    (folder / INFO).parent.mkdir(exist_ok=True)
    (folder / INFO).write_text(json.dumps(value))
    problems: list[str] = []
    described = read_description(folder, problems)
    return described, [each.removeprefix(f"{folder / INFO}: ") for each in problems]


def test_description_separates_columns_and_videos(tmp_path: Path) -> None:
    described, problems = read(tmp_path, {**VALUES, "features": FEATURES})
    assert problems == []
    assert described.videos == {"observation.images.top": Feature("video", (64, 96, 3))}
    assert described.columns["action"] == Feature("float32", (2,))
    assert (described.rate, described.frames) == (20, 21)


@pytest.mark.parametrize(
    ("name", "value", "text"),
    [
        ("codebase_version", "v2.1", "codebase_version: must be 'v3.0' (got 'v2.1')"),
        ("codebase_version", None, "codebase_version: must be 'v3.0' (got None)"),
        ("fps", 12.5, "fps: must be a whole number over 0 (got 12.5)"),
        ("fps", True, "fps: must be a whole number over 0 (got True)"),
        ("total_frames", 21.0, "total_frames: must be a whole number over 0 (got 21.0)"),
        ("total_tasks", 0, "total_tasks: must be a whole number over 0 (got 0)"),
        ("features", [], "features: must be a mapping (got list)"),
        (
            "data_path",
            "../{x}",
            "data_path: must be 'data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet' (got '../{x}')",
        ),
    ],
)
def test_wrong_value_is_a_problem(tmp_path: Path, name: str, value: Any, text: str) -> None:
    assert read(tmp_path, {**VALUES, "features": FEATURES, name: value}) == (None, [text])


@pytest.mark.parametrize(
    ("name", "feature", "text"),
    [
        ("a/b", FEATURES["action"], "a/b: a name has no slash"),
        ("action", [2], "action: must be a mapping (got list)"),
        (
            "action",
            {**FEATURES["action"], "dtype": "floot32"},
            "action: dtype: unknown (got 'floot32'); did you mean float32",
        ),
        (
            "action",
            {**FEATURES["action"], "shape": []},
            "action: shape: must be a list of whole numbers over 0 (got [])",
        ),
        ("action", {**FEATURES["action"], "names": ["x"]}, "action: names: one for each value (got 1 for shape [2])"),
        ("action", {"dtype": "float32", "shape": [2]}, "action: names: is missing"),
        ("index", {**FEATURES["index"], "dtype": "float32"}, "index: must be int64 of shape [1] (got float32 of [1])"),
        ("timestamp", None, "timestamp: must be a mapping (got NoneType)"),
        (
            "observation.images.top",
            {**FEATURES["observation.images.top"], "shape": [63, 96, 3]},
            "observation.images.top: shape: must be height, width and channels, both even (got [63, 96, 3])",
        ),
    ],
)
def test_wrong_feature_is_a_problem(tmp_path: Path, name: str, feature: Any, text: str) -> None:
    assert read(tmp_path, {**VALUES, "features": {**FEATURES, name: feature}}) == (None, [f"features: {text}"])


def test_missing_column_of_every_set_is_a_problem(tmp_path: Path) -> None:
    features = {name: each for name, each in FEATURES.items() if name != "timestamp"}
    assert read(tmp_path, {**VALUES, "features": features}) == (None, ["features: timestamp: is missing"])


_JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=6,
)


@given(st.dictionaries(st.sampled_from([*VALUES, "features", "video_path"]), _JSON), _JSON)
def test_any_json_is_a_problem_or_a_description(
    tmp_path_factory: pytest.TempPathFactory, values: dict[str, Any], feature: Any
) -> None:
    folder = tmp_path_factory.mktemp("described")
    described, problems = read(folder, {**VALUES, "features": {**FEATURES, "action": feature}, **values})
    assert bool(problems) == (described is None)
