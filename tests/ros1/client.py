"""Client in its own process under the system's Python: a function, or the text of a program.

It is forked from an interpreter that has loaded rospy, as are the Python programs of ROS 1.
"""

from __future__ import annotations

import inspect
import json
import os
import textwrap
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from tests.ros1.requirement import ros_python, system_path
from tests.support.processes import Process
from tests.support.waiting import TIMEOUT, has_publisher, wait_until
from tests.support.warm import WarmStart, warm_start

_MODULES = (
    *(
        "actionlib",
        "genpy.generator",
        "genpy.genpy_main",
        "rosbag",
        "roslaunch",
        "rosmaster.main",
        "rosmsg",
        "rosnode",
        "rosparam",
        "rospy",
        "rosservice",
    ),
    *("rostopic", "tf2_msgs.msg", "trajectory_msgs.msg"),
)
_FIRST = """
import os, sys
from rospy import names
names.reload_mappings(sys.argv)
names._caller_namespace = names.get_ros_namespace()
"""
"""For rospy, which reads arguments and environment at its import."""

_RESULT = "result of the client: "
_CALL = """
if __name__ == "__main__":
    import json, sys
    print({result!r} + json.dumps({name}(*json.loads(sys.argv[1]))), flush=True)
"""


def warm_ros() -> WarmStart:
    """Return an interpreter of the system that has loaded the modules of ROS 1 clients and tools."""

    def make() -> WarmStart:
        python = ros_python()
        assert python is not None
        kept = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "ROS"))}
        return WarmStart(_MODULES, python=python, environment={**kept, "PATH": system_path()}, first=_FIRST)

    return warm_start("ROS 1", make)


def function_text(function: Callable[..., object]) -> str:
    """Return a program that calls a function, which imports everything in its own body, and prints its result."""
    return (
        # a client gives up first: its traceback has more information than "still there"
        f"from __future__ import annotations\n\nimport time\n\n\nTIMEOUT = {TIMEOUT / 2}\n"
        + inspect.getsource(wait_until)
        + inspect.getsource(has_publisher)
        + textwrap.dedent(inspect.getsource(function))
        + _CALL.format(result=_RESULT, name=function.__name__)
    )


def function_result(process: Process) -> Any:
    """Return the result that such a program has printed; a traceback fails the test."""
    status = process.finish()
    lines = [line for line in process.out.splitlines() if line.startswith(_RESULT)]
    assert (status, len(lines)) == (0, 1), process.tell(f"status {status}")
    assert "Traceback" not in process.err, process.tell("a traceback")
    return json.loads(lines[0].removeprefix(_RESULT))


class Client(Process):
    """Running client."""

    def __init__(
        self,
        program: str | Callable[..., object],
        arguments: tuple[Any, ...],
        environment: Mapping[str, str],
        folder: Path,
    ) -> None:
        """Start it.

        Args:
            program: the text of a program; or a function that imports everything in its own body.
            arguments: of the function, as JSON values; or of the program, as text.
            environment: its whole environment.
            folder: its working folder; the program is written there.
        """
        python = ros_python()
        assert python is not None
        if callable(program):
            text = function_text(program)
            name, said = program.__name__, [json.dumps(arguments)]
        else:
            text, name, said = program, "program", [str(argument) for argument in arguments]
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / f"{name}.py"
        path.write_text(text)
        super().__init__([python, str(path), *said], environment, folder, warm=warm_ros())

    def value(self) -> Any:
        """Return the function's result, through JSON; a traceback of the client fails the test."""
        return function_result(self)
