"""Message modules from ROS's generators, and their errors."""

import subprocess
from pathlib import Path

import pytest

from cellwright.middleware.messages import TYPES, short_name
from cellwright.middleware.ros1.host.installation import RosSystem, find_system, tool_environment
from cellwright.middleware.ros1.packages.contents import MESSAGE_PACKAGES, write_package
from cellwright.middleware.ros1.packages.tree import generate_modules
from cellwright.middleware.wire.frames import ROS2_ONLY
from cellwright.util.errors import UsageError
from tests.ros1.fake_system import fake_system
from tests.support.waiting import TIMEOUT

__all__ = ["fake_system"]


def test_generated_modules_import_all_messages(fake_system: RosSystem, tmp_path: Path) -> None:
    write_package("osrf_gear", tmp_path / "osrf_gear", tmp_path)
    generate_modules(fake_system, tmp_path, ["osrf_gear"], tmp_path / "python")
    messages = (tmp_path / "python" / "osrf_gear" / "msg" / "__init__.py").read_text()
    assert "from ._Order import *\n" in messages
    assert "from ._AGVControl import *\n" in (tmp_path / "python" / "osrf_gear" / "srv" / "__init__.py").read_text()
    assert (tmp_path / "python" / "osrf_gear" / "__init__.py").is_file()


def test_failing_generator_is_reported_with_its_last_line(fake_system: RosSystem, tmp_path: Path) -> None:
    (tmp_path / "mine" / "msg").mkdir(parents=True)
    (tmp_path / "mine" / "msg" / "Bad.msg").write_text("what is this")
    with pytest.raises(UsageError, match=r"genmsg_py\.py failed for .*mine/msg: this is no message$"):
        generate_modules(fake_system, tmp_path, ["mine"], tmp_path / "python")


@pytest.mark.ros1
def test_generated_types_have_checksums_of_original(tmp_path: Path) -> None:
    ros = find_system()
    for package in MESSAGE_PACKAGES:
        write_package(package, tmp_path / package, tmp_path)
    generate_modules(ros, tmp_path, MESSAGE_PACKAGES, tmp_path / "python")
    defined = [name for name in TYPES.sources if name.split("/")[0] in MESSAGE_PACKAGES]
    names = [name for name in defined if not short_name(name).startswith(ROS2_ONLY)]
    assert len(defined) - len(names) == 7  # of an action that ROS 1 lacks
    program = (
        "import importlib, sys\n"
        "sys.path.insert(0, sys.argv[1])\n"
        "for name in sys.argv[2:]:\n"
        "    package, namespace, last = name.split('/')\n"
        "    print(getattr(importlib.import_module(package + '.' + namespace), last)._md5sum)\n"
    )
    command = [str(ros.python), "-c", program, str(tmp_path / "python"), *names]
    ran = subprocess.run(
        command, env=tool_environment(ros), capture_output=True, text=True, timeout=TIMEOUT, check=True
    )
    assert ran.stdout.split() == [TYPES.md5(short_name(name)) for name in names]
