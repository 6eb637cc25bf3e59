"""Trial whose whole cell stands elsewhere, or turned."""

from dataclasses import replace

from cellwright.config.sensors import PictureCameraConfig, SensorConfig
from cellwright.config.trial.trial import Part, Trial
from cellwright.util.pose import Pose


def moved(trial: Trial, by: Pose) -> Trial:
    """Return a trial whose whole cell is moved and turned about the vertical.

    Layout, sensors, parts, drop regions and furniture keep their places to each other. What stands in the frame of a
    link moves with the link. `written` stays as the file has it.

    Args:
        trial: the trial.
        by: pose of the old world in the new one.

    Example:
        >>> from math import pi
        >>> from cellwright import Pose, load_trial
        >>> turned = moved(load_trial("lesson"), Pose.from_rpy((2.0, 1.0, 0.0), (0.0, 0.0, pi / 2)))
        >>> [round(x, 3) for x in turned.layout.carrier("agv1").home.position]
        [-1.3, 1.3, 0.0]
    """

    def sensor(each: SensorConfig) -> SensorConfig:
        is_on_link = isinstance(each, PictureCameraConfig) and each.frame != "world"
        return each if is_on_link else replace(each, pose=by @ each.pose)

    def part(each: Part) -> Part:
        return replace(each, pose=by @ each.pose) if each.frame == "world" else each

    return replace(
        trial,
        layout=trial.layout.moved(by),
        sensors=tuple(map(sensor, trial.sensors)),
        bin_parts=tuple(map(part, trial.bin_parts)),
        extra_parts=tuple(map(part, trial.extra_parts)),
        drop_regions=tuple(
            replace(each, frame=by @ each.frame, destination=by @ each.destination) for each in trial.drop_regions
        ),
        furniture=tuple(replace(each, pose=by @ each.pose) for each in trial.furniture),
        task=None if trial.task is None else trial.task.moved(by),
    )
