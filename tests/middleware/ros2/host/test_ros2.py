"""Environment of the bridge: room for pictures, unless the user configures Fast DDS."""

from pathlib import Path
from xml.etree import ElementTree

import pytest

from cellwright.middleware.ros2.host.ros2 import OLD_PROFILES_VARIABLE, PROFILES_VARIABLE, transport_variables


@pytest.mark.parametrize(
    ("distribution", "variable"),
    [("humble", OLD_PROFILES_VARIABLE), ("jazzy", OLD_PROFILES_VARIABLE), ("kilted", PROFILES_VARIABLE)],
)
def test_profile_of_the_bridge_is_named_by_the_variable_of_the_distribution(distribution: str, variable: str) -> None:
    ((name, file),) = transport_variables(distribution, {}).items()
    assert name == variable
    size = ElementTree.parse(file).findtext(".//{*}segment_size")
    assert Path(file).is_file()
    assert size is not None
    assert int(size) > 10 * 640 * 480 * 3


@pytest.mark.parametrize("name", [OLD_PROFILES_VARIABLE, PROFILES_VARIABLE, "FASTDDS_BUILTIN_TRANSPORTS"])
def test_configuration_of_the_user_is_kept(name: str) -> None:
    assert transport_variables("jazzy", {name: "UDPv4"}) == {}
