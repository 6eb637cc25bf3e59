"""Fake ROS 1 with only message generators, which write empty classes: for tests that need no real one."""

import sys
from pathlib import Path

import pytest

from cellwright.middleware.ros1.host.installation import RosSystem

GENERATOR = """\
import sys
from pathlib import Path

arguments = sys.argv[1:]
if any("Bad" in argument for argument in arguments):
    sys.exit("something before\\nthis is no message")
out = Path(arguments[arguments.index("-o") + 1])
for argument in arguments:
    if argument.endswith((".msg", ".srv")):
        name = Path(argument).stem
        (out / f"_{name}.py").write_text(f"class {name}:\\n    pass\\n")
"""


@pytest.fixture
def fake_system(tmp_path: Path) -> RosSystem:
    """The installation, with one package that has no manifest."""
    prefix = tmp_path / "usr"
    for path, text in {
        "lib/genpy/genmsg_py.py": GENERATOR,
        "lib/genpy/gensrv_py.py": GENERATOR,
        "share/std_msgs/msg/String.msg": "string data\n",
        "share/geometry_msgs/package.xml": "<package/>",
    }.items():
        (prefix / path).parent.mkdir(parents=True, exist_ok=True)
        (prefix / path).write_text(text)
    return RosSystem(prefix, Path(sys.executable))
