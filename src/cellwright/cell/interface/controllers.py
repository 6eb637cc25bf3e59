"""Controller manager of ROS 1: the services of `ros_control` for both controllers of the arm, which always run.

In ROS 2 the server offers others (`cell/controllers.py`). Changes are refused as the original does, by `ok: false`; the
reason is reported.
"""

from collections.abc import Iterable, Sequence

from cellwright.middleware.bus import Refusals
from cellwright.middleware.interface.table import Endpoint
from cellwright.middleware.messages.controller_manager_msgs import (
    ControllerState,
    HardwareInterfaceResources,
    ListControllersRequest,
    ListControllersResponse,
    ListControllerTypesRequest,
    ListControllerTypesResponse,
    LoadControllerRequest,
    LoadControllerResponse,
    ReloadControllerLibrariesRequest,
    ReloadControllerLibrariesResponse,
    SwitchControllerRequest,
    SwitchControllerResponse,
    UnloadControllerRequest,
    UnloadControllerResponse,
)

ARM_CONTROLLER, JOINT_STATES = "arm", "joint_state_controller"
"""Names of the controllers, those of the parameters below `/ariac`."""

TYPES = {
    ARM_CONTROLLER: "effort_controllers/JointTrajectoryController",
    JOINT_STATES: "joint_state_controller/JointStateController",
}
"""Type of each controller."""

_BASE = "controller_interface::ControllerBase"
_RUNNING = "is always running in this cell"


class ControllerServices:
    """Handlers of the controller manager's services.

    Args:
        refusals: counts and reports what is refused.
        joints: joints of the arm.
        subject: subject of the arm's rows.
    """

    def __init__(self, refusals: Refusals, joints: Sequence[str], subject: str | None = None) -> None:
        self._refusals, self.subject = refusals, subject
        self._interfaces = {
            ARM_CONTROLLER: ("hardware_interface::EffortJointInterface", sorted(joints)),
            JOINT_STATES: ("hardware_interface::JointStateInterface", []),  # reading claims nothing
        }

    def list_controllers(self, _row: Endpoint, _request: ListControllersRequest, _node: str) -> ListControllersResponse:
        """Return both controllers."""
        return ListControllersResponse(
            [
                ControllerState(name, "running", kind, [HardwareInterfaceResources(*self._interfaces[name])])
                for name, kind in TYPES.items()
            ]
        )

    def list_controller_types(
        self, _row: Endpoint, _request: ListControllerTypesRequest, _node: str
    ) -> ListControllerTypesResponse:
        """Return the types of both controllers."""
        return ListControllerTypesResponse([*TYPES.values()], [_BASE] * len(TYPES))

    def switch_controller(self, row: Endpoint, request: SwitchControllerRequest, node: str) -> SwitchControllerResponse:
        """Refuse a change; to start a running controller changes nothing, and succeeds."""
        strict = request.strictness != SwitchControllerRequest.BEST_EFFORT
        unknown = _unknown([*request.start_controllers, *request.stop_controllers])
        stopped = [name for name in request.stop_controllers if name in TYPES]
        if stopped:
            return SwitchControllerResponse(self._refuse(row, node, f"{stopped[0]} {_RUNNING}"))
        if unknown and strict:
            return SwitchControllerResponse(self._refuse(row, node, unknown))
        return SwitchControllerResponse(ok=True)

    def load_controller(self, row: Endpoint, request: LoadControllerRequest, node: str) -> LoadControllerResponse:
        """Refuse to load a controller."""
        reason = _unknown([request.name]) or f"{request.name} is loaded already"
        return LoadControllerResponse(self._refuse(row, node, reason))

    def unload_controller(self, row: Endpoint, request: UnloadControllerRequest, node: str) -> UnloadControllerResponse:
        """Refuse to unload a controller."""
        reason = _unknown([request.name]) or f"{request.name} {_RUNNING}"
        return UnloadControllerResponse(self._refuse(row, node, reason))

    def reload_controller_libraries(
        self, row: Endpoint, _request: ReloadControllerLibrariesRequest, node: str
    ) -> ReloadControllerLibrariesResponse:
        """Refuse to load the libraries again."""
        return ReloadControllerLibrariesResponse(self._refuse(row, node, f"{ARM_CONTROLLER} {_RUNNING}"))

    def _refuse(self, row: Endpoint, node: str, reason: str) -> bool:
        """Report a refusal; return False."""
        self._refusals.refuse(f"{row.name} from {node}" if node else row.name, reason)
        return False


def _unknown(names: Iterable[str]) -> str:
    """Return what is wrong with the first unknown name; empty if all are known."""
    unknown = [name for name in names if name not in TYPES]
    return f"no controller {unknown[0]!r:.60}; there are {' and '.join(TYPES)}" if unknown else ""
