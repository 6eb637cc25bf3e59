"""Card of a data set: its README for the hub, with a head in YAML."""

from collections.abc import Sequence

from cellwright._package import VERSION
from cellwright.recording.dataset.episode import Episode

_HEAD = """\
---
license: other
task_categories:
- robotics
tags:
- LeRobot
configs:
- config_name: default
  data_files: data/*/*.parquet
---
"""
_TEXT = """
# {robot}: {episodes} episodes

LeRobotDataset v3.0, written by Cellwright {version} from recordings of simulated runs.

| | |
|---|---|
| robot | {robot} |
| rate | {rate} Hz: frame k is at k / {rate} s |
| episodes | {episodes}, {successes} of them succeeded |
| frames | {frames} |
| columns | {columns} |
| cameras | {cameras} |

- `action` is the executed command, in force from its frame to the next.
- `stats.json` has the exact mean, deviation and quantiles over all frames and pixels; LeRobot's own writer approximates
  quantiles by episode.
- The license is the choice of the owner: edit `license` in the head of this file.

## Episodes

| episode | frames | success | recording | task |
|---|---|---|---|---|
"""


def card(episodes: Sequence[Episode]) -> str:
    """Return the card of a set of episodes, which all have the form of the first."""
    first = episodes[0]
    text = _TEXT.format(
        robot=first.robot,
        version=VERSION,
        rate=first.rate,
        episodes=len(episodes),
        successes=sum(each.is_success for each in episodes),
        frames=sum(each.frames for each in episodes),
        columns=", ".join(f"`{column.name}`" for column in first.columns),
        cameras=", ".join(f"`{camera}`" for camera in first.cameras) or "none",
    )
    rows = [_row(number, each) for number, each in enumerate(episodes)]
    return _HEAD + text + "".join(rows)


def _row(number: int, episode: Episode) -> str:
    success = "yes" if episode.is_success else "no"
    texts = f"{_cell(episode.source)} | {_cell(episode.sentence)}"
    return f"| {number} | {episode.frames} | {success} | {texts} |\n"


def _cell(text: str) -> str:
    """Return a text that stays in its cell of a table."""
    return " ".join(text.replace("|", "\\|").split())
