"""Process of an assembled robot: its controller node, for the program that started it and for other clients.

It reads its order from stdin, a JSON object: `urdf` is a path, `configs` the robot configuration, `parent` the id of
the process that started it. `window` and `sliders` are true or false. It prints one line of JSON: `host` and `port`, or
`error`.
"""

import json
import os
import re
import signal
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import yaml

from cellwright.clients.assembled.process import OWNER
from cellwright.config.robot.config import RobotConfig
from cellwright.config.robot.robots import read_robot_config
from cellwright.engine.loop import SimulationLoop
from cellwright.middleware.server import Server
from cellwright.robot.node import RobotNode
from cellwright.robot.services import RobotServices
from cellwright.util.errors import CellwrightError
from cellwright.viewer.window import Window, WindowError

_CONNECT_TIMEOUT = 30.0  # [s] of wall time within which the program must connect


def main() -> int:
    """Run a robot until its program is gone; return the exit status."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a Ctrl-C on the terminal is for the program
    order = json.load(sys.stdin)
    try:
        node = RobotNode(configuration(order), stamp=time.time_ns, report=_report)
        server = Server(node, port=0, report=_report)
    except CellwrightError as error:
        _write_answer({"error": str(error)})
        return 1
    RobotServices(node).offer(server)
    if order["window"]:
        try:
            Window(node.world.model, server.address, sliders=bool(order["sliders"]))
        except WindowError as error:  # the robot moves without it
            _report(str(error))
    host, port = server.address
    _write_answer({"host": host, "port": port})
    _run(node, server, int(order["parent"]))
    return 0


def _run(node: RobotNode, server: Server, parent: int) -> None:
    """Step the robot until the program is gone."""
    begun, has_connected = time.monotonic(), False

    def check_owner() -> None:
        nonlocal has_connected
        is_connected = OWNER in server.clients
        has_connected = has_connected or is_connected
        is_late = not has_connected and time.monotonic() - begun > _CONNECT_TIMEOUT
        is_orphan = os.name == "posix" and os.getppid() != parent
        if (has_connected and not is_connected) or is_late or is_orphan:
            loop.stop.request()

    loop = SimulationLoop(node.simulation, server, on_poll=check_owner)
    try:
        loop.run()
        reason = "the program has ended"
    except CellwrightError as error:
        _report(str(error))
        reason = str(error)
    server.close(reason)
    node.simulation.close()


def configuration(order: dict[str, Any]) -> RobotConfig:
    """Return the robot of an order. Errors of its file are reported as errors of the configuration.

    Raises:
        CellwrightError: it is no configuration, or not one of this robot.
    """
    configs = order["configs"]
    if not isinstance(configs, dict):
        raise CellwrightError(
            f"configs: must be a dictionary, as `yaml.safe_load` returns it (got {type(configs).__name__})"
        )
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "configs.yml"
        file.write_text(yaml.safe_dump({**configs, "urdf_path": order["urdf"]}, sort_keys=False), encoding="utf-8")
        place = re.compile(re.escape(str(file)) + r"(:\d+)?")
        try:
            return read_robot_config(file, lambda warning: _report(place.sub("configs", warning)))
        except CellwrightError as error:
            raise CellwrightError(place.sub("configs", str(error))) from None


def _write_answer(answer: dict[str, Any]) -> None:
    sys.stdout.write(json.dumps(answer) + "\n")
    sys.stdout.flush()


def _report(line: str) -> None:
    sys.stderr.write(f"robot: {line}\n")
    sys.stderr.flush()
