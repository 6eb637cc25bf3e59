"""Arguments behind `--ros-args`: rules of another form are refused, with the argument and a valid form."""

import pytest

from cellwright.middleware.ros2.host.arguments import check_ros_arguments
from cellwright.util.errors import UsageError


@pytest.mark.parametrize(
    "words",
    [
        "",
        "-r __ns:=/cell1 --remap ariac/orders:=/orders",
        "-r cellwright:__ns:=/cell1 -r rostopic:///tf:=tf -r a:=~/b",
        "-p use_sim_time:=true --param cellwright:name:=a:b",
        "--params-file file.yaml --log-level debug --disable-rosout-logs -e /x",
    ],
)
def test_valid_arguments_pass(words: str) -> None:
    check_ros_arguments(words.split())


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("-r __ns:cell1", "--ros-args: -r __ns:cell1: not a rule; give -r FROM:=TO, such as -r __ns:=/cell1"),
        ("-r a:=b --remap a:=", "--ros-args: --remap a:=: not a rule; give -r FROM:=TO, such as -r __ns:=/cell1"),
        ("-r", "--ros-args: -r: not a rule; give -r FROM:=TO, such as -r __ns:=/cell1"),
        ("-p speed 3", "--ros-args: -p speed: not a rule; give -p NAME:=VALUE, such as -p use_sim_time:=true"),
        ("-r __ns:=cell1", "--ros-args: -r __ns:=cell1: a namespace begins with /; give -r __ns:=/cell1"),
        ("-r n:__ns:=cell1", "--ros-args: -r n:__ns:=cell1: a namespace begins with /; give -r n:__ns:=/cell1"),
    ],
)
def test_argument_without_rule_is_named(words: str, said: str) -> None:
    with pytest.raises(UsageError) as refused:
        check_ros_arguments(words.split())
    assert str(refused.value) == said
