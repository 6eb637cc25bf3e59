"""Pictures of the last states of the worst runs, for the report."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from cellwright.rendering.backend import RAYS
from cellwright.rendering.picture import PictureRequest, encode_png
from cellwright.rendering.views import gear2017_views
from cellwright.running.evaluation.results.result import Result
from cellwright.running.evaluation.results.state import State, StateError, loses_points, read_state, state_file
from cellwright.running.evaluation.results.summary import worst_first
from cellwright.util.errors import RenderingError, UsageError

MAX_PICTURES = 10
"""Runs with a picture, the worst ones."""
MAX_BY_RAYS = 3
"""The same where there is no OpenGL: a picture then takes 1.7 s of a core."""

_WIDTH, _HEIGHT = 480, 270  # [pixels]


def draw_worst(folder: Path, results: Sequence[Result], on_miss: Callable[[str], None]) -> Mapping[str, bytes]:
    """Return PNG files of the last states of the worst runs that lost points, by the keys of their results.

    A process of its own draws them, by OpenGL in 1.3 s for ten, or else fewer of them by rays.

    Args:
        folder: that of the results.
        results: all results.
        on_miss: receives a line if pictures cannot be drawn.
    """
    states: dict[str, State] = {}
    for result in worst_first(filter(loses_points, results))[:MAX_PICTURES]:
        try:
            states[result.key] = read_state(state_file(folder, result.log_name))
        except StateError:
            # such as of a run whose process ended at its start
            continue
    if not states:
        return {}
    from cellwright.rendering.worker import RenderWorker  # slow to load

    try:
        with RenderWorker() as worker:
            numbers: dict[Path, int] = {}
            for state in states.values():
                if state.scene_file not in numbers:
                    number = numbers[state.scene_file] = len(numbers) + 1
                    if worker.ask("scene", number, state.scene).result() == RAYS:
                        states = dict(list(states.items())[:MAX_BY_RAYS])
            drawn = {}
            for key, each in states.items():
                request = PictureRequest((each.scene.views or gear2017_views())["overview"], _WIDTH, _HEIGHT)
                drawn[key] = worker.colour(each.frame, request, numbers[each.scene_file])
            return {key: encode_png(picture.result()) for key, picture in drawn.items()}
    except (RenderingError, UsageError, OSError) as error:
        on_miss(f"no pictures in the report: {error}")
        return {}
