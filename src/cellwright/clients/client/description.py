"""A client that a cell describes itself to: its places, its arms, its part types and its shapes."""

import json
from collections.abc import Mapping
from typing import Any, cast

from cellwright.clients.client.session import NodeClient
from cellwright.config.control import ControlSpace
from cellwright.config.layout.data import layout_from_data, value_of
from cellwright.config.layout.layout import Layout
from cellwright.middleware.messages.std_srvs import TriggerRequest
from cellwright.motion.chain import Chain
from cellwright.motion.robot_arms import RobotArm

_PART_TYPES = "/cellwright/part_types"
_SOLIDS = "/cellwright/solids"
LAYOUT = "/cellwright/layout"
"""Service by which a cell describes itself."""
_CHAINS, _CONTROL, _ROBOT_ARMS, _SENTENCE, _TIMESTEP = "chains", "control", "robot_arms", "sentence", "timestep"


class CellDescription(NodeClient):
    """Client that asks a cell for what does not change while it runs."""

    def layout(self) -> Layout:
        """Return the layout of the cell: places and sizes of its bins, belts, trays, AGVs and the arm's rail.

        Lengths are in m, poses in the world. It says nothing of parts and orders.

        Example:
            >>> from cellwright import Cell, Client, Trial
            >>> layout = Client.in_process(Cell(Trial("2017's cell"))).layout()
            >>> layout.bin("bin7").surface, [each.name for each in layout.carriers]
            (0.725, ['agv1', 'agv2'])

        Raises:
            CellwrightError: the server is no cell, or the cell's version is another one.
        """
        return layout_of(self._layout())

    def chains(self) -> Mapping[str, Chain]:
        """Return the arms of the cell as chains of joints, by their names in the layout; none where there is no arm.

        A chain goes from the frame of the arm's mount, in the layout, to its cup; with a rail its first joint is that.

        Example:
            >>> from cellwright import Cell, Client, Trial
            >>> chains = Client.in_process(Cell(Trial("one arm", has_arm=True))).chains()
            >>> [joint.name for joint in chains["arm"].joints][:2]
            ['linear_arm_actuator_joint', 'shoulder_pan_joint']

        Raises:
            CellwrightError: the server is no cell, or the cell's version is another one.
        """
        return chains_of(self._layout())

    def robot_arms(self) -> Mapping[str, tuple[RobotArm, ...]]:
        """Return the arms of the cell's robots as chains of joints, by the names of the robots in the layout.

        Example:
            >>> from cellwright import Cell, Client, load_trial
            >>> arms = Client.in_process(Cell(load_trial("reach"))).robot_arms()["qinglong"]
            >>> [arm.name for arm in arms], len(arms[0].chain.joints)
            (['right', 'left'], 7)

        Raises:
            CellwrightError: the server is no cell, or the cell's version is another one.
        """
        return robot_arms_of(self._layout())

    def control_space(self) -> ControlSpace:
        """Return what can be commanded in the cell: the joints and grippers of its arms, and the joints of its robots.

        Example:
            >>> from cellwright import Cell, Client, Trial
            >>> space = Client.in_process(Cell(Trial("one arm", has_arm=True))).control_space()
            >>> space.names[0], space.names[-1]
            ('linear_arm_actuator_joint', 'suction')

        Raises:
            CellwrightError: the server is no cell, or the cell's version is another one.
        """
        return cast("ControlSpace", value_of(ControlSpace, self._layout().get(_CONTROL), _CONTROL))

    @property
    def sentence(self) -> str:
        """The task of the trial in words; empty if it has none.

        Example:
            >>> from cellwright import Cell, Client, load_trial
            >>> Client.in_process(Cell(load_trial("pick_from_bin"))).sentence
            'Pick up a gear from the bin.'

        Raises:
            CellwrightError: the server is no cell, or the cell's version is another one.
        """
        return str(self._layout().get(_SENTENCE, ""))

    def timestep(self) -> tuple[int, int]:
        """Return the length of a tick of the cell [s], as numerator and denominator.

        Example:
            >>> from cellwright import Cell, Client, Trial
            >>> Client.in_process(Cell(Trial("empty"))).timestep()
            (1, 500)

        Raises:
            CellwrightError: the server is no cell, or the cell's version is another one.
        """
        return cast("tuple[int, int]", value_of(tuple[int, int], self._layout().get(_TIMESTEP), _TIMESTEP))

    def _layout(self) -> dict[str, Any]:
        return dict(json.loads(self.call(LAYOUT, TriggerRequest()).message))

    def part_types(self) -> Mapping[str, Mapping[str, Any]]:
        """Return the part types of the trial's own, by name; empty where there are none.

        Each has its `mass` [kg] and `tops`: its shape seen from above, first as modelled, then with each of the five
        other sides up. The frame of a top has the part's origin and z up; `turn` is the quaternion (w, x, y, z) of that
        frame in the part's. A top has these values, lengths in m:

        - `centre_of_mass`;
        - the box (`lower`, `upper`), and the `radius` of the floor plan about the middle of that box;
        - `spots` that the cup can stand on, the best first: their `position`, and the `radius` of the flat disc.

        Raises:
            CellwrightError: the server has no such service: it is no cell.
        """
        answer = json.loads(self.call(_PART_TYPES, TriggerRequest()).message)
        return {str(name): dict(values) for name, values in answer.items()}

    def solids(self) -> Mapping[str, list[Mapping[str, Any]]]:
        """Return the shapes of the arm and of what it must not hit, but for parts, by frame: its links, and "world".

        Those of AGVs are where they stand at their load points. A shape has the `body` that it belongs to, its `type`,
        and its `position` [m] and `quaternion` (w, x, y, z) in the frame. The meaning of its `size` [m] depends on the
        type: radius of a sphere; radius and half length of a capsule or cylinder along z; half axes of an ellipsoid;
        half edges of a box. A plane is the half space below its z = 0. A mesh has `vertices` [m] in its own frame, and
        is their convex hull, whose surface are the `triangles` between them, counter-clockwise seen from outside.

        Raises:
            CellwrightError: the server has no such service: it is no cell.
        """
        answer = json.loads(self.call(_SOLIDS, TriggerRequest()).message)
        return {str(frame): list(shapes) for frame, shapes in answer.items()}


def layout_of(description: Mapping[str, Any]) -> Layout:
    """Return the layout in a cell's description of itself, the JSON object of the service `LAYOUT`."""
    beside = (_CHAINS, _CONTROL, _ROBOT_ARMS, _SENTENCE, _TIMESTEP)
    return layout_from_data({name: value for name, value in description.items() if name not in beside})


def chains_of(description: Mapping[str, Any]) -> dict[str, Chain]:
    """Return the arms in a cell's description; see `CellDescription.chains`."""
    return {str(name): value_of(Chain, each, f"chains.{name}") for name, each in description[_CHAINS].items()}


def robot_arms_of(description: Mapping[str, Any]) -> dict[str, tuple[RobotArm, ...]]:
    """Return the arms of robots in a cell's description; see `CellDescription.robot_arms`."""
    kind, found = tuple[RobotArm, ...], description.get(_ROBOT_ARMS, {})
    return {str(name): value_of(kind, each, f"{_ROBOT_ARMS}.{name}") for name, each in found.items()}
