"""Collisions of a cell's arms and robots during a run."""

from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from fractions import Fraction
from typing import Any

import mujoco
import numpy as np

from cellwright.cell.cell import Cell
from cellwright.cell.devices.arm import Arm
from cellwright.cell.devices.arm_guard import FAR, ArmDistances
from cellwright.cell.model.link_frames import frames_by_link
from cellwright.config.layout.arm_models import joints_of, moving_links
from cellwright.engine.clock import NANOSECONDS
from cellwright.viewer.services.names import MIN_DEVIATION

PERIOD = Fraction(1, 20)
"""Simulation time [s] between two checks of the contacts."""

MIN_DURATION = 0.2
"""Shorter contacts [s] are no collisions: the arm brushes a bin's rim as it takes a part."""

GAP = 0.5
"""A contact that comes again within this time [s] is the same collision: an arm that is held up rattles."""

MAX_SHOWN = 20
"""Number of collisions in a panel, the newest ones."""


@dataclass(slots=True)
class Collision:
    """A contact of a link of an arm or a robot with an obstacle.

    Those of a suction cup do not count, nor those of fingers and hands with parts, nor those of a robot with what it
    stands on.

    Attributes:
        owner: name of the arm or robot.
        link: frame of the link.
        obstacle: name of the body that it hit, such as `camera frame 2`, `bin8`, a part, or a link of another arm or
            robot.
        begin: simulation time [s].
        end: simulation time [s] of the last check at which they touched.
        deviation: largest distance [m] of the arm's tool from its setpoint meanwhile; 0 for a link of a robot.
    """

    owner: str
    link: str
    obstacle: str
    begin: float
    end: float
    deviation: float = 0.0

    @property
    def duration(self) -> float:
        """Simulation time [s] from the first touch to the last."""
        return self.end - self.begin

    def sentence(self) -> str:
        """Return the collision in words.

        Example:
            >>> Collision("arm", "forearm_link", "camera frame 2", 12.3, 15.4, 0.041).sentence()
            'forearm_link against camera frame 2, 12.3 to 15.4 s; the tool was held up 41 mm from its goal'
        """
        held_up = f"; the tool was held up {self.deviation * 1e3:.0f} mm from its goal"
        text = f"{self.link} against {self.obstacle}, {self.begin:.1f} to {self.end:.1f} s"
        return text + (held_up if self.deviation > MIN_DEVIATION else "")


@dataclass(frozen=True, slots=True, eq=False)
class _Watched:
    """Arm or robot under watch.

    Attributes:
        name: its name.
        arm: the arm's device; None for a robot.
        joints: addresses of the arm's joints in `qpos`.
        tool: body of its last link in the engine.
    """

    name: str
    arm: Arm | None = None
    joints: list[int] = field(default_factory=list)
    tool: int = 0


@dataclass(frozen=True, slots=True)
class Approach:
    """Smallest distance between two arms or robots in a run.

    Attributes:
        distance: distance of two links [m]; negative where they overlap.
        link: frame of a link.
        other: frame of the other's.
        time: simulation time [s].
    """

    distance: float
    link: str
    other: str
    time: float

    def sentence(self) -> str:
        """Return the approach in words.

        Example:
            >>> Approach(0.034, "arm1_forearm_link", "arm2_wrist_3_link", 12.3).sentence()
            'arm1_forearm_link 34 mm from arm2_wrist_3_link at 12.3 s'
        """
        return f"{self.link} {self.distance * 1e3:.0f} mm from {self.other} at {self.time:.1f} s"


class CollisionWatch:
    """Collision monitor of a cell's arms and robots; it does not affect the run.

    Args:
        on_collision: called with each collision that is over.
    """

    def __init__(self, cell: Cell, on_collision: Callable[[Collision], None] = lambda _collision: None) -> None:
        self._cell = cell
        self._on_collision = on_collision
        self._open: dict[tuple[int, int], Collision] = {}
        self.collisions: list[Collision] = []
        """Collisions that are over, in the order of their ends."""
        self._links: dict[int, _Watched] = {}
        """The arm or robot of each link, by the link's body in the engine."""
        self._fingers: set[int] = set()
        """Bodies of the fingers of parallel grippers, and of hands of robots."""
        self._frames = frames_by_link(cell.trial)
        model = cell.simulation.model
        for arm in cell.trial.arms:
            names = [arm.prefix + name for name in joints_of(arm, cell.trial.arm_models)]
            joints = [int(model.joint(name).qposadr[0]) for name in names]
            watched = _Watched(arm.name, cell.arms[arm.name], joints, int(model.body(arm.holder).id))
            # the cup's own contacts do not count, nor do those of fingers with parts
            cup = arm.holder if arm.tool.kind == "vacuum" else ""
            links = [name for name in moving_links(arm, cell.trial.arm_models) if name != cup]
            self._links |= {int(model.body(name).id): watched for name in links}
            if arm.tool.kind == "parallel":
                self._fingers |= {int(model.body(name).id) for name in arm.gripper_names.fingers}
        for robot in cell.trial.layout.robots:
            config, watched = cell.trial.robot_models[robot.name], _Watched(robot.name)
            self._links |= {int(model.body(robot.prefix + link).id): watched for link in config.robot.links}
            self._fingers |= {int(model.body(robot.prefix + link).id) for link in config.hand_links}
        self._link_ids = [*self._links]
        self._standing: set[tuple[int, int]] = self._find_standing()
        """Robots' links, each with what it stands on."""
        self._setpoint: mujoco.MjData | None = None
        self._distances = ArmDistances(cell.simulation, cell.trial)
        self.nearest: Approach | None = None
        """Smallest distance between two arms or robots; None with one of them."""
        self._watch = cell.simulation.watch("collisions", PERIOD, self._look)

    def end(self) -> list[Collision]:
        """Stop watching; return all collisions, including those that still last."""
        self._watch.cancel()
        self._close(float("inf"))
        return self.collisions

    def panel(self) -> dict[str, Any]:
        """Return the content of a panel as JSON values: the `count` of collisions, and the `latest` by their ends.

        Those that still last come last, and their `end` is None. `deviation` is in whole millimetres [m]. With several
        arms or robots, `nearest` is their smallest distance so far.
        """
        over = [asdict(each) for each in self.collisions[-MAX_SHOWN:]]
        lasting = [asdict(each) | {"end": None} for each in self._open.values() if each.duration >= MIN_DURATION]
        latest = [each | {"deviation": round(each["deviation"], 3)} for each in (over + lasting)[-MAX_SHOWN:]]
        nearest = {} if self.nearest is None else {"nearest": asdict(self.nearest)}
        return {"count": len(self.collisions) + len(lasting), "latest": latest, **nearest}

    def reset(self, _stood: int = 0) -> None:
        """Forget all collisions: the run has started again."""
        self._open.clear()
        self.collisions, self.nearest = [], None
        self._standing = self._find_standing()

    def rewind(self, time: int) -> None:
        """Forget all collisions after `time` [ns]: the run goes back there."""
        self._open.clear()
        self.collisions = [each for each in self.collisions if each.end <= time / NANOSECONDS]
        if self.nearest is not None and self.nearest.time > time / NANOSECONDS:
            self.nearest = None

    def _look(self, _index: int) -> None:
        simulation = self._cell.simulation
        data = simulation.data
        touching = {
            (link, body)
            for link, body in self._contacts(simulation.model, data)
            if (link not in self._fingers or body not in self._cell.parts.by_body)
            and (link, body) not in self._standing
        }
        now = simulation.time
        if self._open:
            self._close(now)
        deviations = {owner: self._deviation(owner) for owner in {self._links[link] for link, _ in touching}}
        for link, body in touching:
            names = self._links[link].name, self._name(link), _shown(self._name(body))
            open_ = self._open.setdefault((link, body), Collision(*names, now, now))
            open_.end, open_.deviation = now, max(open_.deviation, deviations[self._links[link]])

        for pair in self._distances.pairs:
            found = self._distances.nearest(*pair, within=FAR if self.nearest is None else self.nearest.distance)
            if found is not None:
                self.nearest = Approach(*found, now)

    def _contacts(self, model: mujoco.MjModel, data: mujoco.MjData) -> set[tuple[int, int]]:
        """Return the links that touch something, each with the other body; of two links, that of an arm comes first."""
        if not data.ncon:
            return set()
        bodies = model.geom_bodyid[data.contact.geom[: data.ncon]]
        pairs = bodies[np.isin(bodies, self._link_ids).any(axis=1)].tolist()
        return {(link, body) for pair in pairs for link, body in [sorted(pair, key=self._rank)]}

    def _rank(self, body: int) -> tuple[int, int]:
        """Return the rank of a body among those that touch: links of arms, links of robots, others."""
        watched = self._links.get(body)
        return (2 if watched is None else int(watched.arm is None)), body

    def _find_standing(self) -> set[tuple[int, int]]:
        """Return the links of robots that touch something fixed as a run begins, each with that body."""
        if not self._cell.trial.layout.robots:
            return set()
        model, data = self._cell.world.model, self._cell.world.initial_data()
        mujoco.mj_fwdPosition(model, data)
        return {
            pair
            for pair in self._contacts(model, data)
            if self._links[pair[0]].arm is None and not model.body_weldid[pair[1]]
        }

    def _name(self, body: int) -> str:
        if (part := self._cell.parts.by_body.get(body)) is not None:
            return part.name
        name = str(self._cell.simulation.model.body(body).name)
        return self._frames.get(name, name)

    def _close(self, now: float) -> None:
        for pair in [pair for pair, collision in self._open.items() if now - collision.end > GAP]:
            collision = self._open.pop(pair)
            if collision.duration >= MIN_DURATION:
                self.collisions.append(collision)
                self._on_collision(collision)

    def _deviation(self, watched: _Watched) -> float:
        """Return the distance [m] of an arm's tool from its setpoint; 0 for a robot."""
        if watched.arm is None:
            return 0.0
        simulation = self._cell.simulation
        model = simulation.first_model  # the arms are the same in all
        if self._setpoint is None:
            self._setpoint = mujoco.MjData(model)
        self._setpoint.qpos[watched.joints] = watched.arm.following().desired.positions
        mujoco.mj_kinematics(model, self._setpoint)
        simulation.refresh()
        offset = simulation.data.xpos[watched.tool] - self._setpoint.xpos[watched.tool]
        return float(np.linalg.norm(offset))


def _shown(body: str) -> str:
    """Return the words for a body of the model that is no link."""
    if body == "world":
        return "floor"
    return body.replace("_frame", " frame").replace("frame_", "frame ").replace("_belt", " belt")
