"""Observations of an environment: named arrays, made of a cell when they are asked for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final, TypeAlias, cast

import numpy as np
from gymnasium.spaces import Box, Dict, Space

from cellwright.config.control import ControlSpace
from cellwright.config.sensors import PictureCameraConfig
from cellwright.config.trial.trial import Trial
from cellwright.envs.privileged import PrivilegedState
from cellwright.envs.stepper import CellStepper
from cellwright.rendering.cameras.picture_camera import PictureCamera, ask_pictures
from cellwright.util.errors import UnknownNameError

AGENT_POS: Final = "agent_pos"
"""Measured values of the channels, float32: positions [rad; m], suction (1 = on), widths [m]."""
ENVIRONMENT_STATE: Final = "environment_state"
"""Privileged state, float32; see `PrivilegedState`."""
PIXELS: Final = "pixels"
"""Pictures by camera, height × width × 3, uint8."""

Observation: TypeAlias = dict[str, Any]
Asked: TypeAlias = Callable[[], Observation]

_MOST = 1e4
"""Bound of all numbers: no joint and no part of a cell is beyond it [rad; m]."""


class Observations:
    """Observations of a trial with a task.

    Args:
        trial: the trial.
        space: its channels.
        cameras: names of the colour cameras whose pictures are observed.
        privileged: True to observe the privileged state.

    Attributes:
        space: the space of the observations.
        state_names: names of the numbers of `environment_state`.

    Raises:
        UnknownNameError: there is no such camera.
    """

    def __init__(self, trial: Trial, space: ControlSpace, cameras: Sequence[str], *, privileged: bool) -> None:
        assert trial.task is not None
        self._cameras = tuple(_camera(trial, name) for name in cameras)
        self._state = PrivilegedState(trial, trial.task) if privileged else None
        self.state_names = () if self._state is None else self._state.names
        spaces: dict[str, Space[Any]] = {AGENT_POS: Box(-_MOST, _MOST, (len(space.channels),), np.float32)}
        if self.state_names:
            spaces[ENVIRONMENT_STATE] = Box(-_MOST, _MOST, (len(self.state_names),), np.float32)
        if self._cameras:
            pictures: dict[str, Space[Any]] = {
                each.name: Box(0, 255, (each.height, each.width, 3), np.uint8) for each in self._cameras
            }
            spaces[PIXELS] = Dict(pictures)
        self.space = Dict(spaces)

    def ask(self, stepper: CellStepper) -> Asked:
        """Read the numbers of now, ask for the pictures, and return the function that waits for them.

        Time may go on meanwhile, in this cell too. The function returns the observation.

        Raises:
            UsageError: nothing can be drawn; the function raises it too.
        """
        # the process that draws works, while this one reads the numbers
        cameras = [cast("PictureCamera", stepper.cell.sensors[each.name]) for each in self._cameras]
        pictures = ask_pictures(cameras)
        found: Observation = {AGENT_POS: np.array(stepper.read(), np.float32)}
        if self._state is not None and self._state.names:
            found[ENVIRONMENT_STATE] = np.array(self._state.read(stepper.cell), np.float32)

        def awaited() -> Observation:
            if cameras:
                found[PIXELS] = {camera.name: each.colour for camera, each in zip(cameras, pictures(), strict=True)}
            return found

        return awaited


def _camera(trial: Trial, name: str) -> PictureCameraConfig:
    found = {each.name: each for each in trial.sensors if isinstance(each, PictureCameraConfig) and each.has_colour}
    if name not in found:
        raise UnknownNameError("colour camera", name, found)
    return found[name]
