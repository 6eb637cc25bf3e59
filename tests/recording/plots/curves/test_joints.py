"""Selection and drawing of joints."""

import numpy as np
from matplotlib.figure import Figure

from cellwright.recording.plots.curves import MAX_JOINTS, draw_joints, joints_to_draw
from cellwright.recording.plots.tracks import JointTrack, Span

TIMES = np.linspace(0.0, 10.0, 101)


def moving(name: str, by: float) -> JointTrack:
    return JointTrack(name, "rad", TIMES, by * np.sin(TIMES), TIMES, by * np.sin(TIMES + 0.1))


def title_of(tracks: list[JointTrack]) -> str:
    axes = Figure().add_subplot()
    draw_joints(axes, "right arm", tracks)
    return axes.get_title(loc="left") or axes.get_title()


def test_joints_that_move_most_are_drawn_in_own_order() -> None:
    tracks = [moving(f"j{n}", by=0.1 + (n * 7 % 12)) for n in range(12)] + [moving("still", 0.0)]
    drawn = joints_to_draw(tracks)
    assert len(drawn) == MAX_JOINTS
    assert [int(track.name[1:]) for track in drawn] == sorted(int(track.name[1:]) for track in drawn)
    assert min(track.travel for track in drawn) > max(track.travel for track in tracks if track not in drawn)


def test_group_without_motion_draws_one_joint() -> None:
    assert [track.name for track in joints_to_draw([moving("a", 0.0), moving("b", 0.0)])] == ["a"]


def test_title_counts_joints_left_out() -> None:
    assert title_of([moving("a", 1.0)]) == "right arm"
    assert title_of([moving("a", 1.0), moving("b", 0.0)]) == "right arm (1 stand still)"
    many = [moving(f"j{n}", 1.0 + n) for n in range(MAX_JOINTS + 2)]
    assert title_of(many) == "right arm (2 more)"
    assert title_of([*many, moving("b", 0.0)]) == "right arm (3 more, of which 1 stand still)"


def test_joint_has_solid_position_and_dashed_target() -> None:
    axes = Figure().add_subplot()
    draw_joints(axes, "arm", [moving("elbow", 1.0), JointTrack("free", "rad", TIMES, np.cos(TIMES))])
    styles = [line.get_linestyle() for line in axes.lines]
    assert styles.count("--") == 1
    assert styles.count("-") == 2
    assert [text.get_text() for text in axes.texts] == ["elbow", "free", "dashed: target"] or {
        text.get_text() for text in axes.texts
    } == {"elbow", "free", "dashed: target"}


def test_collisions_are_marked_and_explained_beside_targets() -> None:
    axes = Figure().add_subplot()
    draw_joints(axes, "arm", [moving("elbow", 1.0)], [Span(2.0, 3.0, "forearm / bin8")])
    (crosses,) = [line for line in axes.lines if line.get_marker() == "x"]
    assert np.asarray(crosses.get_xdata()).tolist() == [2.0]
    assert "dashed: target   \N{MULTIPLICATION SIGN} grey: collision" in [text.get_text() for text in axes.texts]
