"""Frames of the links of arms and robots, by the names that the links have in the engine."""

from cellwright.config.layout.arm_models import links_by_frame
from cellwright.config.trial.trial import Trial


def frames_by_link(trial: Trial) -> dict[str, str]:
    """Return the frames of all links of a trial's arms and robots, by the names of the links in the engine.

    Example:
        >>> import cellwright
        >>> frames_by_link(cellwright.load_trial("lesson"))["forearm_link"]
        'forearm_link'
    """
    frames = {link: frame for frame, link in links_by_frame(trial.arms, trial.arm_models).items()}
    for robot in trial.layout.robots:
        links = (robot.prefix + link for link in trial.robot_models[robot.name].robot.links)
        frames |= {link: robot.frame_of(link) for link in links}
    return frames
