"""ROS 2 transport: a relay process under a Python that has rclpy, for programs that have none.

Over a cell in lockstep the result is that of a run in one process. As in ROS 1, a refused message is not reported to
its publisher; nor is a call that fails, since ROS 2 has no way to say so.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

from cellwright._package import FOLDER
from cellwright.clients.client.ros1_transport import RelayTransport

PROGRAM = Path(FOLDER) / "middleware" / "ros2" / "bridge" / "relay.py"


class Ros2Transport(RelayTransport):
    """Transport to a cell in ROS 2.

    Args:
        python: an interpreter that has rclpy.
        node: absolute name of the client's node.
        environment: of the relay, with the domain; this process's own by default.
        timeout: longest wait [s] for a simulator to appear.
        sign: a topic that is published exactly while a simulator is there.
        arguments: rclpy's own, without `--ros-args`, such as `("-r", "__ns:=/cell1")`; names here stay those without.

    Raises:
        UsageError: there is no simulator, or the relay cannot be started.
    """

    def __init__(
        self,
        python: str,
        *,
        node: str = "/agent",
        environment: Mapping[str, str] | None = None,
        timeout: float = 30.0,
        sign: str = "/clock",
        arguments: Sequence[str] = (),
    ) -> None:
        command = [python, str(PROGRAM), f"--node={node}", f"--wait={timeout}", f"--sign={sign}"]
        if arguments:
            command += ["--ros-args", *arguments]
        super().__init__(command, environment, node=node, encoding="ros2", timeout=timeout)
