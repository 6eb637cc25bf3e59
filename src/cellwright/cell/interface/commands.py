"""Command topics and services of the kit-building cell: handlers of the 2017 interface."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Any, cast, get_args

from cellwright.cell.devices.agv import Agv
from cellwright.cell.devices.arm import Arm
from cellwright.cell.devices.conveyor import PopulationAction
from cellwright.cell.devices.joint_trajectory import JointTrajectory, TrajectoryPoint
from cellwright.cell.devices.kit_tray import KitTray
from cellwright.cell.devices.trajectory_controller import check_count
from cellwright.cell.devices.vacuum_gripper import VacuumGripper
from cellwright.cell.interface.devices import INTENTION_TOPIC as INTENTION
from cellwright.cell.interface.devices import GearDevices
from cellwright.cell.interface.rows import PART_TYPES
from cellwright.cell.kitting.inventory import MaterialLocations
from cellwright.cell.model.own_models import own_part_types
from cellwright.cell.model.part_tops import part_tops
from cellwright.config.trial.trial import Trial
from cellwright.middleware.bus import Bus, Refusals
from cellwright.middleware.messages.control_msgs import QueryTrajectoryStateRequest, QueryTrajectoryStateResponse
from cellwright.middleware.messages.conversions import floats, nanoseconds
from cellwright.middleware.messages.osrf_gear import (
    AGVControlRequest,
    AGVControlResponse,
    ConveyorBeltControlRequest,
    ConveyorBeltControlResponse,
    GetMaterialLocationsRequest,
    GetMaterialLocationsResponse,
    PopulationControlRequest,
    PopulationControlResponse,
    StorageUnit,
    SubmitTrayRequest,
    SubmitTrayResponse,
    VacuumGripperControlRequest,
    VacuumGripperControlResponse,
)
from cellwright.middleware.messages.standard import JointTrajectory as JointTrajectoryMessage
from cellwright.middleware.messages.standard import String
from cellwright.middleware.messages.std_srvs import TriggerRequest, TriggerResponse
from cellwright.util.errors import RejectedCommandError, ServiceFailedError, UnknownNameError, UsageError


def part_types_json(trial: Trial) -> str:
    """The part types of a trial's own, by name, as a JSON object; lengths in m, mass in kg.

    Each has its `mass`, and `tops` with the fields of `world.part_tops.PartTop`, the first as it was modelled. Where
    parts are, this does not tell.
    """
    found = {
        name: {"mass": own.form.mass, "tops": [asdict(top) for top in part_tops(own.form)]}
        for name, own in own_part_types(trial).items()
    }
    return json.dumps(found, sort_keys=True)


SIMULATOR = "/gazebo"
"""The node that the cell appears as. A guest may call itself so as well: the name allows nothing."""

NOT_ALLOWED = "not allowed in a competition"


class Commands:
    """The handlers of one cell's command topics and services.

    Args:
        devices: what they act on.
        competition: whether cheats are refused; the cell itself does such things without a service.
    """

    def __init__(self, devices: GearDevices, *, competition: bool) -> None:
        self._devices = devices
        self._is_competition = competition
        self._locations = MaterialLocations(devices.trial.material_locations)
        self._refusals: Refusals | None = None
        self._own_types: str | None = None

    def serve(self, bus: Bus) -> None:
        """Put all of them on the bus."""
        self._refusals = bus.refusals
        devices = self._devices
        services: dict[str, tuple[str, Any]] = {
            "start_competition": ("std_srvs/Trigger", self._start),
            "end_competition": ("std_srvs/Trigger", self._end),
            "material_locations": ("osrf_gear/GetMaterialLocations", self._material_locations),
            "conveyor/control": ("osrf_gear/ConveyorBeltControl", self._conveyor),
            "submit_tray": ("osrf_gear/SubmitTray", self._submit_tray),
        }
        for number, agv in devices.agvs.items():
            services[f"agv{number}"] = ("osrf_gear/AGVControl", _agv_handler(agv))
            clear = f"kit_tray_{number}/clear_tray"
            services[clear] = ("std_srvs/Trigger", self._clear_handler(clear, agv.tray))
        if devices.population is not None and not self._is_competition:
            services["population/control"] = ("osrf_gear/PopulationControl", self._population)
        if devices.gripper is not None:
            services["gripper/control"] = ("osrf_gear/VacuumGripperControl", _gripper_handler(devices.gripper))
        if devices.arm is not None:
            services["arm/query_state"] = ("control_msgs/QueryTrajectoryState", _query_handler(devices.arm))
            bus.listen(
                "/ariac/arm/command", "trajectory_msgs/JointTrajectory", _arm_handler(devices.arm), node=SIMULATOR
            )
        bus.listen(INTENTION, "std_msgs/String", self._intention, node=SIMULATOR)
        bus.serve(PART_TYPES, "std_srvs/Trigger", self._part_types, node=SIMULATOR)
        for name, (type_name, handler) in services.items():
            bus.serve(f"/ariac/{name}", type_name, handler, node=SIMULATOR)

    # ---------------------------------------------------------------- the competition

    def _start(self, _request: TriggerRequest, _node: str) -> TriggerResponse:
        try:
            self._devices.competition.start()
        except RejectedCommandError:
            return TriggerResponse(success=False, message="cannot start if not in 'init' state")
        return TriggerResponse(success=True, message="competition started successfully!")

    def _end(self, _request: TriggerRequest, _node: str) -> TriggerResponse:
        self._devices.competition.end()
        return TriggerResponse(success=True, message="competition ended successfully!")

    def _material_locations(self, request: GetMaterialLocationsRequest, _node: str) -> GetMaterialLocationsResponse:
        units = self._locations.locations(request.material_type)
        return GetMaterialLocationsResponse([StorageUnit(unit) for unit in units])

    def _part_types(self, _request: TriggerRequest, _node: str) -> TriggerResponse:
        if self._own_types is None:
            self._own_types = part_types_json(self._devices.trial)
        return TriggerResponse(success=True, message=self._own_types)

    def _intention(self, message: String, node: str) -> None:
        self._devices.intention.say(message.data, node, self._devices.simulation.now)

    # ---------------------------------------------------------------- cheats

    def _may_cheat(self, service: str, node: str) -> bool:
        """Whether cheats are allowed; if not, the answer and the report say so."""
        if not self._is_competition:
            return True
        if self._refusals is not None:
            source = f"/ariac/{service} from {node}" if node else f"/ariac/{service}"
            self._refusals.refuse(source, f"{NOT_ALLOWED}; development mode (-d) allows it")
        return False

    def _conveyor(self, request: ConveyorBeltControlRequest, node: str) -> ConveyorBeltControlResponse:
        if not self._may_cheat("conveyor/control", node):
            return ConveyorBeltControlResponse(success=False)
        # a power outside 0..100 leaves the belt as it is, and is answered with success all the same
        self._devices.conveyor.set_power(request.state.power)
        return ConveyorBeltControlResponse(success=True)

    def _submit_tray(self, request: SubmitTrayRequest, node: str) -> SubmitTrayResponse:
        if not self._may_cheat("submit_tray", node):
            return SubmitTrayResponse(success=False, inspection_result=0.0)
        try:
            submitted = self._devices.competition.submit(request.tray_id, request.kit_type)
        except UnknownNameError:
            return SubmitTrayResponse(success=False, inspection_result=0.0)
        except RejectedCommandError as error:
            raise ServiceFailedError(f"submit_tray: {error}") from error
        return SubmitTrayResponse(success=True, inspection_result=submitted.score.total)

    def _clear_handler(self, service: str, tray: KitTray) -> Any:
        def clear(_request: TriggerRequest, node: str) -> TriggerResponse:
            if not self._may_cheat(service, node):
                return TriggerResponse(success=False, message=NOT_ALLOWED)
            tray.remove_all()
            return TriggerResponse(success=True, message="")

        return clear

    def _population(self, request: PopulationControlRequest, _node: str) -> PopulationControlResponse:
        population = self._devices.population
        if population is not None and request.action in get_args(PopulationAction):
            population.control(cast("PopulationAction", request.action))
        else:
            raise ServiceFailedError(
                f"population/control: {request.action!r} is none of {', '.join(get_args(PopulationAction))}"
            )
        return PopulationControlResponse(success=True)


def _agv_handler(agv: Agv) -> Any:
    def send(request: AGVControlRequest, _node: str) -> AGVControlResponse:
        return AGVControlResponse(success=agv.send(request.kit_type))

    return send


def _gripper_handler(gripper: VacuumGripper) -> Any:
    def control(request: VacuumGripperControlRequest, _node: str) -> VacuumGripperControlResponse:
        gripper.set_enabled(request.enable)
        return VacuumGripperControlResponse(success=True)

    return control


def _arm_handler(arm: Arm) -> Any:
    def command(message: JointTrajectoryMessage, _node: str) -> None:
        arm.command(trajectory_of(message))

    return command


def _query_handler(arm: Arm) -> Any:
    def query(request: QueryTrajectoryStateRequest, _node: str) -> QueryTrajectoryStateResponse:
        try:
            state = arm.controller.query_state(nanoseconds(request.time))
        except UsageError as error:
            raise ServiceFailedError(f"query_state: {error}") from error
        return QueryTrajectoryStateResponse(
            list(arm.controller.joint_names),
            floats(state.positions),
            floats(state.velocities),
            floats(state.accelerations),
        )

    return query


def trajectory_of(message: JointTrajectoryMessage) -> JointTrajectory:
    """A commanded trajectory from its message; a stamp of zero means now.

    Raises:
        RejectedTrajectoryError: it has too many points to be looked at.
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
        start or None,
    )
