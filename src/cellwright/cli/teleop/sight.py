"""What is to be seen of a robot whose node runs: a window meanwhile, a picture at the end."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from ipaddress import ip_address
from pathlib import Path

from rich.console import Console

from cellwright.cli.bar import bar
from cellwright.middleware.server import Server
from cellwright.middleware.server.server import LOOPBACK
from cellwright.robot.node import RobotNode
from cellwright.robot.pictures import save_robot_picture
from cellwright.robot.services import RobotServices
from cellwright.viewer.window import Window, WindowError


@dataclass(frozen=True)
class Sight:
    """What somebody wants to see.

    Attributes:
        window: MuJoCo's window, while the node runs.
        sliders: with a slider for each joint in it.
        snapshot: a picture of how the robot stands at the end goes to this file.
    """

    window: bool = False
    sliders: bool = False
    snapshot: Path | None = None

    @contextmanager
    def shown(self, node: RobotNode, server: Server) -> Iterator[None]:
        """Have the window open; it closes with the server.

        Raises:
            WindowError: there can be none; node and server are closed then.
        """
        if not self.window:
            yield
            return
        RobotServices(node).offer_state(server)
        try:
            host, port = server.address
            address = LOOPBACK if ip_address(host).is_unspecified else host
            window = Window(node.world.model, (address, port), sliders=self.sliders)
        except WindowError as error:
            node.close()
            server.close(str(error))
            raise
        try:
            yield
        finally:
            window.close()

    def save(self, node: RobotNode, console: Console) -> None:
        """Write the picture, if one is wanted; it takes some seconds.

        Raises:
            UsageError: it cannot be written.
        """
        if self.snapshot is not None:
            with bar(console, f"drawing {self.snapshot}", 1.0) as tell:
                save_robot_picture(self.snapshot, node.world, node.simulation.data, progress=tell)
