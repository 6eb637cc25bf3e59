"""Command topics and services of the kit-building cell: handlers of the 2017 interface."""

import json
from collections.abc import Mapping
from dataclasses import asdict, replace
from functools import cache
from typing import cast, get_args

from cellwright.cell.devices.conveyor import PopulationAction
from cellwright.cell.devices.finger_gripper import FingerGripper
from cellwright.cell.interface.devices import CellDevices, named, of_arm
from cellwright.cell.model.build import World
from cellwright.cell.model.own_models import OwnPartType
from cellwright.cell.model.part_tops import part_tops
from cellwright.cell.model.solids import solids
from cellwright.config.control import ControlSpace
from cellwright.config.layout.arm_models import chain_in_engine
from cellwright.config.layout.data import layout_data, plain
from cellwright.config.trial.trial import Trial
from cellwright.config.ur10 import GRIPPER
from cellwright.engine.clock import NANOSECONDS, seconds
from cellwright.mechanism.gripper_goal import GripperRequest
from cellwright.mechanism.joint_trajectory import JointTrajectory, TrajectoryPoint
from cellwright.mechanism.trajectory_controller import check_count
from cellwright.middleware.bus import Refusals
from cellwright.middleware.interface.notes import Notes
from cellwright.middleware.interface.table import Endpoint
from cellwright.middleware.messages import Message, osrf_gear
from cellwright.middleware.messages.control_msgs import (
    GripperCommand,
    QueryTrajectoryStateRequest,
    QueryTrajectoryStateResponse,
)
from cellwright.middleware.messages.conversions import floats, nanoseconds
from cellwright.middleware.messages.standard import JointTrajectory as JointTrajectoryMessage
from cellwright.middleware.messages.standard import String
from cellwright.middleware.messages.std_srvs import TriggerRequest, TriggerResponse
from cellwright.motion.chain import chain_of
from cellwright.motion.robot_arms import robot_arms
from cellwright.util.errors import RejectedCommandError, ServiceFailedError, UnknownNameError, UsageError

NOT_ALLOWED = "not allowed in a competition"
NO_OPERATOR = "no operator works this cell; start it with `cellwright run TRIAL --operator`"
_WALL_TIME = 1_000_000_000 * NANOSECONDS
"""Stamps from here on are wall time: seconds since 1970, in 2001. No run lasts thirty years."""


def part_types_json(own: Mapping[str, OwnPartType]) -> str:
    """Return the trial's own part types by name as a JSON object; lengths in m, mass in kg.

    Each type has its `mass`, and `tops` with the fields of `cell.model.part_tops.PartTop`, the first one as modelled.
    The object has no positions of parts. It takes about 30 ms a type.
    """
    found = {
        name: {"mass": each.form.mass, "tops": [asdict(top) for top in part_tops(each.form)]}
        for name, each in own.items()
    }
    return json.dumps(found, sort_keys=True)


def layout_json(trial: Trial) -> str:
    """Return a cell's layout as a JSON object, with the `chains` of its arms by their names in the layout.

    `control` is what can be commanded, a `ControlSpace`; `robot_arms` are the arms of each robot; `sentence` is the
    task in words, empty without one; `timestep` is the length of a tick [s] as a fraction.

    A chain goes from the frame of the arm's mount to the frame of its cup, or to its tip if it holds nothing. Its
    joints have their names in messages, and its links those of their frames.
    """
    chains = {}
    for arm in trial.arms:
        robot = chain_in_engine(arm, trial.arm_models)
        chain = chain_of(robot, arm.prefix + (GRIPPER if arm.tool.kind == "vacuum" else arm.tip))
        joints = (replace(each, name=arm.joint_prefix + each.name.removeprefix(arm.prefix)) for each in chain.joints)
        links = {arm.frame_of(name): link for name, link in chain.links.items()}
        chains[arm.name] = plain(replace(chain, joints=tuple(joints), links=links))
    layout = replace(trial.layout, carriers=trial.carriers)
    more = {
        "chains": chains,
        "control": plain(ControlSpace.of(trial)),
        "robot_arms": {
            robot.name: plain(robot_arms(trial.robot_models[robot.name], robot.pose)) for robot in trial.layout.robots
        },
        "sentence": "" if trial.task is None else trial.task.sentence,
        "timestep": trial.settings.timestep,
    }
    return json.dumps({**layout_data(layout), **more}, allow_nan=False)


class CellCommands(Notes):
    """Handlers of the topics and services that clients send to.

    The reply about the trial's own part types is computed in the constructor, before time runs.
    """

    def __init__(self, cell: CellDevices, world: World) -> None:
        self._cell = cell
        self._own_types = part_types_json(world.own_types)
        self._solids = cache(lambda: json.dumps(solids(world)))
        self._layout = cache(lambda: layout_json(cell.trial))

    def start_competition(self, _row: Endpoint, _request: TriggerRequest, _node: str) -> TriggerResponse:
        """Start the trial."""
        try:
            self._cell.competition.start()
        except RejectedCommandError:
            return TriggerResponse(success=False, message="cannot start if not in 'init' state")
        return TriggerResponse(success=True, message="competition started successfully!")

    def end_competition(self, _row: Endpoint, _request: TriggerRequest, _node: str) -> TriggerResponse:
        """End the trial."""
        self._cell.competition.end()
        return TriggerResponse(success=True, message="competition ended successfully!")

    def material_locations(
        self, _row: Endpoint, request: osrf_gear.GetMaterialLocationsRequest, _node: str
    ) -> osrf_gear.GetMaterialLocationsResponse:
        """Storage units of a type, or the tray of a kit, by name; none for an unknown type."""
        units = self._cell.trial.locations(request.material_type)
        return osrf_gear.GetMaterialLocationsResponse([osrf_gear.StorageUnit(unit) for unit in sorted(units)])

    def part_types(self, _row: Endpoint, _request: TriggerRequest, _node: str) -> TriggerResponse:
        """The trial's own part types."""
        return TriggerResponse(success=True, message=self._own_types)

    def solids(self, _row: Endpoint, _request: TriggerRequest, _node: str) -> TriggerResponse:
        """The solid shapes of arm and cell."""
        return TriggerResponse(success=True, message=self._solids())

    def layout(self, _row: Endpoint, _request: TriggerRequest, _node: str) -> TriggerResponse:
        """The layout of the cell."""
        return TriggerResponse(success=True, message=self._layout())

    def note_intention(self, _row: Endpoint, message: String, node: str) -> None:
        """Record the agent's stated intention."""
        self._cell.intention.update(message.data, node, self._cell.simulation.now)

    def note_operator(self, _row: Endpoint, message: String, _node: str) -> None:
        """Take the state of an operator agent."""
        self._cell.intention.operator.update(message.data)

    def request_operator(self, row: Endpoint, _message: Message, _node: str) -> None:
        """Refuse a request that no operator agent would hear; else the agent gets it from the topic."""
        if self._cell.intention.operator.state is None:
            raise RejectedCommandError(f"{row.name}: {NO_OPERATOR}")

    def command_arm(self, row: Endpoint, message: JointTrajectoryMessage, node: str) -> None:
        """Make the arm follow a trajectory."""
        trajectory = trajectory_of(message, self._cell.simulation.clock.offset)
        of_arm(self._cell.arms, self._cell.trial, row.subject).command(trajectory)
        warn_of_wall_time(self._cell.bus.refusals, f"{row.name} from {node}" if node else row.name, trajectory)

    def query_arm_state(
        self, row: Endpoint, request: QueryTrajectoryStateRequest, _node: str
    ) -> QueryTrajectoryStateResponse:
        """Desired state of the joints at a time."""
        controller = of_arm(self._cell.arms, self._cell.trial, row.subject).controller
        try:
            state = controller.query_state(nanoseconds(request.time) - self._cell.simulation.clock.offset)
        except UsageError as error:
            raise ServiceFailedError(f"query_state: {error}") from error
        return QueryTrajectoryStateResponse(list(controller.joint_names), *map(floats, state))

    def control_gripper(
        self, row: Endpoint, request: osrf_gear.VacuumGripperControlRequest, _node: str
    ) -> osrf_gear.VacuumGripperControlResponse:
        """Switch the suction, or close or open the fingers."""
        of_arm(self._cell.grippers, self._cell.trial, row.subject).set_enabled(request.enable)
        return osrf_gear.VacuumGripperControlResponse(success=True)

    def command_gripper(self, row: Endpoint, message: GripperCommand, _node: str) -> None:
        """Move the fingers to a distance."""
        gripper = of_arm(self._cell.grippers, self._cell.trial, row.subject)
        assert isinstance(gripper, FingerGripper)  # the row is for those alone
        gripper.goals.command(GripperRequest("", message.position, message.max_effort))

    def send_agv(self, row: Endpoint, request: osrf_gear.AGVControlRequest, _node: str) -> osrf_gear.AGVControlResponse:
        """Send an AGV to inspection, or submit a fixed tray."""
        return osrf_gear.AGVControlResponse(success=self._cell.senders[row.subject or ""].send(request.kit_type))

    def refuse(self, row: Endpoint, _request: Message, node: str) -> Message:
        """Refuse a service that counts as cheating in a competition, and report the refusal."""
        source = f"{row.name} from {node}" if node else row.name
        self._cell.bus.refusals.refuse(source, f"{NOT_ALLOWED}; development mode (-d) allows it")
        # the empty answer of all these services means: without success
        response = self._cell.bus.types.service(row.type).response()
        if isinstance(response, TriggerResponse):
            response.message = NOT_ALLOWED
        return response

    def control_conveyor(
        self, row: Endpoint, request: osrf_gear.ConveyorBeltControlRequest, _node: str
    ) -> osrf_gear.ConveyorBeltControlResponse:
        """Set a belt's power; a value outside 0..100 changes nothing, and still succeeds."""
        named(self._cell.conveyors, row.subject).set_power(request.state.power)
        return osrf_gear.ConveyorBeltControlResponse(success=True)

    def control_population(
        self, row: Endpoint, request: osrf_gear.PopulationControlRequest, _node: str
    ) -> osrf_gear.PopulationControlResponse:
        """Pause, resume or restart the flow of parts onto a belt."""
        actions = get_args(PopulationAction)
        if request.action not in actions:
            raise ServiceFailedError(
                f"population/control: unknown action {request.action!r} (known: {', '.join(actions)})"
            )
        named(self._cell.populations, row.subject).control(cast("PopulationAction", request.action))
        return osrf_gear.PopulationControlResponse(success=True)

    def submit_tray(
        self, _row: Endpoint, request: osrf_gear.SubmitTrayRequest, _node: str
    ) -> osrf_gear.SubmitTrayResponse:
        """Judge a tray as a kit."""
        try:
            submitted = self._cell.competition.submit(request.tray_id, request.kit_type)
        except UnknownNameError:
            return osrf_gear.SubmitTrayResponse(success=False, inspection_result=0.0)
        except RejectedCommandError as error:
            raise ServiceFailedError(f"submit_tray: {error}") from error
        return osrf_gear.SubmitTrayResponse(success=True, inspection_result=submitted.score.total)

    def clear_tray(self, row: Endpoint, _request: TriggerRequest, _node: str) -> TriggerResponse:
        """Remove all objects from a tray."""
        self._cell.trays[int(row.subject or 0)].remove_all()
        return TriggerResponse(success=True, message="")


def warn_of_wall_time(refusals: Refusals, source: str, trajectory: JointTrajectory) -> None:
    """Report a trajectory that starts at a wall time, decades ahead in simulation time: the arm waits for it."""
    start = trajectory.start_ns or 0
    if start >= _WALL_TIME and trajectory.points:
        refusals.warn(
            source,
            f"the trajectory is stamped with wall time ({seconds(start):.0f} s), so the arm waits for decades of "
            "simulation time; set use_sim_time to true, or leave the stamp at 0 to start at once",
        )


def trajectory_of(message: JointTrajectoryMessage, clock_offset: int = 0) -> JointTrajectory:
    """Return the trajectory of a message; a stamp of zero means now.

    Args:
        message: the message; its stamp is in message time.
        clock_offset: message time at the begin of the run [ns].

    Raises:
        RejectedTrajectoryError: it has too many points.
    """
    check_count(message.points)
    start = nanoseconds(message.header.stamp)
    return JointTrajectory(
        tuple(message.joint_names),
        tuple(
            TrajectoryPoint(
                point.positions.tolist(),
                point.velocities.tolist(),
                point.accelerations.tolist(),
                nanoseconds(point.time_from_start),
            )
            for point in message.points
        ),
        start - clock_offset if start else None,
    )
