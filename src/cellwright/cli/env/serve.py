"""Command `cellwright env serve`: an environment for a program in another process."""

import os
from threading import Thread
from typing import TYPE_CHECKING, Annotated

import typer

from cellwright.cli import options, output
from cellwright.cli.arguments import END, NETWORK, SIMULATION, TRIAL
from cellwright.cli.parameters import flag, option
from cellwright.cli.signals import keep_until_signal
from cellwright.viewer.web.start import LOOPBACK

if TYPE_CHECKING:
    from cellwright.envs import EnvServer


def serve(
    task: Annotated[str, TRIAL],
    rate: Annotated[float, option("HZ", "Control periods in a second.", SIMULATION)] = 20.0,
    control: Annotated[
        str,
        option(
            "KIND", "Actions: `absolute` targets in rad and m, or `delta`, changes of them from -1 to 1.", SIMULATION
        ),
    ] = "absolute",
    cameras: Annotated[
        str | None, option("NAMES", "Colour cameras whose pictures are observed, such as `front,wrist`.", SIMULATION)
    ] = None,
    no_privileged: Annotated[
        bool, flag("--no-privileged", "Leave out `environment_state`, which no real sensor tells.", SIMULATION)
    ] = False,
    host: Annotated[str, option("HOST", "Address to listen on.", NETWORK)] = LOOPBACK,
    port: Annotated[int, option("N", "Port to listen on; 0 takes a free one.", NETWORK)] = 0,
    exit_with_stdin: Annotated[
        bool, flag("--exit-with-stdin", "Stop when standard input ends, as with the program that holds it.", END)
    ] = False,
) -> None:
    """Serve an environment for learning, until Ctrl-C: a trial with a task, for one client at a time.

    Simulation time passes only in a step. The address is printed once the server listens. `adapters/cellwright_env` has
    a client in one file for Python programs that do not have Cellwright.

        # the address is a websocket's, such as ws://127.0.0.1:40123
        cellwright env serve pick_from_bin

    Exit status: 0 stopped as requested; 2 bad input, and nothing was started.
    """
    options.in_range("--port", port, 0, 65535, "a port from 0 to 65535")
    trial = options.load([task])
    from cellwright import envs  # slow to load; without the extra `gym`, the error says so

    names = [] if cameras is None else [each.strip() for each in cameras.split(",")]
    session = envs.EnvSession(
        trial,
        rate=rate,
        control=control,  # type: ignore[arg-type]  # it checks
        cameras=names,
        privileged=not no_privileged,
    )

    def start() -> "EnvServer":
        server = envs.EnvServer(session, host, port)
        if exit_with_stdin:
            Thread(target=_end_with_stdin, args=(server,), daemon=True).start()
        if not server.is_local:
            output.warn(f"{host}: open to the network; every program that reaches this machine can use the environment")
        typer.echo(f"serving {trial.name} at {server.address}")
        return server

    keep_until_signal(start)


def _end_with_stdin(server: "EnvServer") -> None:
    # the descriptor itself: a thread that reads `sys.stdin` at the end of the process would hold its lock
    while os.read(0, 4096):
        pass
    server.end()
