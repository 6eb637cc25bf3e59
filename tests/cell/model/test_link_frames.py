"""Frames of the links of arms and robots."""

from cellwright.cell.model.link_frames import frames_by_link
from tests.cell.robot_cells import BESIDE_ARM, tandem_cell


def test_links_of_arms_and_robots_have_the_frames_of_their_owners() -> None:
    frames = frames_by_link(tandem_cell(BESIDE_ARM))
    assert (frames["forearm_link"], frames["tandem/torso"]) == ("forearm_link", "tandem_torso")
    assert len(set(frames.values())) == len(frames)
