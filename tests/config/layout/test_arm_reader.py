"""Arms in the section `cell`: their entries and the files of their models."""

import shutil
from pathlib import Path

import pytest

from cellwright.config.layout.arms import OnLink
from cellwright.config.robot.model import link_poses
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.trial import Trial
from cellwright.util.errors import DescriptionError
from cellwright.util.pose import Pose
from tests.cell.arm_cells import carried_cell

ARMS = Path(__file__).parents[2] / "data" / "arms"
UR5 = "model: ur5.urdf, mount: {kind: pedestal, at: [0, 0]}, tip: tool0"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Folder with the model of an arm."""
    shutil.copy(ARMS / "ur5.urdf", tmp_path)
    return tmp_path


def read(folder: Path, arm: str, **more: str) -> Trial:
    """Return the trial of a cell with an arm, by the entries of the arm."""
    lines = ["cell:", f"  arms: {{left: {{{arm}}}}}", *(f"{key}: {value}" for key, value in more.items())]
    (folder / "cell.yaml").write_text("\n".join(lines))
    return load_trial([folder / "cell.yaml"]).trial


def refusals(folder: Path, arm: str) -> list[str]:
    """Return what is wrong with an arm, without the names of files."""
    with pytest.raises(DescriptionError) as caught:
        read(folder, arm)
    return [str(problem).replace(f"{folder}/", "") for problem in caught.value.problems]


def test_arm_with_a_model_of_its_own_is_read(folder: Path) -> None:
    trial = read(
        folder,
        f"{UR5}, tool: {{kind: vacuum, length: 0.12}}, home: {{elbow_joint: pi/2}}, bandwidth: 60, "
        "limits: {elbow_joint: {lower: -2, upper: 2, effort: 100}}, collision: {kind: hull}",
    )
    (arm,) = trial.arms
    assert (arm.name, arm.model, arm.tip, arm.tool.length, arm.bandwidth) == ("left", "ur5.urdf", "tool0", 0.12, 60.0)
    assert arm.mount.pose.position == (0.0, 0.0, 0.5)
    assert arm.home == {"elbow_joint": pytest.approx(1.5707963)}
    elbow = trial.joints["elbow_joint"]
    assert (elbow.lower, elbow.upper, elbow.effort, elbow.velocity) == (-2.0, 2.0, 100.0, 3.15)
    assert [each.name for each in trial.layout.structure] == ["left_pedestal"]


def test_model_in_a_package_is_found(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = folder / "path" / "my_robots"
    package.mkdir(parents=True)
    shutil.move(folder / "ur5.urdf", package / "ur5.urdf")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(folder / "path"))
    assert read(folder, UR5.replace("ur5.urdf", "package://my_robots/ur5.urdf")).joints
    monkeypatch.delenv("ROS_PACKAGE_PATH")
    (package / "__init__.py").touch()
    monkeypatch.syspath_prepend(folder / "path")
    assert read(folder, UR5.replace("ur5.urdf", "package://my_robots/ur5.urdf")).joints


@pytest.mark.parametrize(
    ("arm", "text"),
    [
        (UR5.replace("ur5.urdf", "ur6.urdf"), "there is no file ur6.urdf in "),
        (UR5.replace("ur5.urdf", "package://none/ur5.urdf"), "package 'none', of ROS or of Python"),
        (UR5.replace("tip: tool0", "tip: tool1"), "unknown link 'tool1'; did you mean tool0"),
        (UR5.replace(", tip: tool0", ""), "name the link at the arm's end: tip"),
        (f"{UR5}, home: {{elbow: 1}}", "unknown joint 'elbow'; did you mean elbow_joint"),
        (f"{UR5}, home: {{elbow_joint: 9}}", "elbow_joint: must be from -"),
        (f"{UR5}, limits: {{elbo_joint: {{effort: 9}}}}", "unknown joint 'elbo_joint'; did you mean elbow_joint"),
        (f"{UR5}, tool: {{kind: magnet}}", "kind of tool"),
        ("mount: {kind: floor, at: [0, 0]}", "without a model the arm is a UR10 on the rail of 2017"),
        ("mount: {kind: rail, at: [0, 0]}, tip: tool0", "tip needs a model"),
        (
            "mount: {kind: rail, at: [0, 0]}, home: {elbo_joint: 1}",
            "unknown joint 'elbo_joint'; did you mean elbow_joint",
        ),
        (f"{UR5}, namespace: a/b", "namespace: must be letters, digits and _"),
        (f"{UR5}, names: long", "unknown names of joints 'long'"),
        (f"{UR5}, drives: as_given", "left.drives: only an MJCF file gives drives (got ur5.urdf); use drives: stiff"),
        (f"{UR5}, drives: given", "unknown drives 'given'; did you mean as_given"),
        (f"{UR5}, collision: {{primitives: {{forarm_link: []}}}}", "unknown link 'forarm_link'; did you mean forearm"),
        (
            f"{UR5}, collision: {{primitives: {{tool0: [{{sphere: {{radius: 0}}}}]}}}}",
            "tool0[0].sphere: lengths of a sphere must be from 0.0001 to",
        ),
        (
            f"{UR5}, collision: {{primitives: {{tool0: [{{sphere: {{radius: 0.1}}, use: seen}}]}}}}",
            "tool0[0].use: unknown entry",
        ),
        (
            f"{UR5}, collision: {{primitives: {{tool0: [{{pose: {{xyz: [0, 0, 0]}}}}]}}}}",
            "must have exactly one of box, cylinder, capsule, sphere (got none)",
        ),
        (f"{UR5}, collision: {{primitives: {{tool0: 3}}}}", "must be a list of 0 to 200 shapes (got the number 3)"),
    ],
)
def test_arm_with_a_mistake_is_refused_with_line_and_remedy(folder: Path, arm: str, text: str) -> None:
    (problem,) = refusals(folder, arm)
    assert problem.startswith("cell.yaml:2: cell.arms.left")
    assert text in problem


def test_arm_on_a_link_begins_where_the_other_arm_has_it_at_home() -> None:
    gantry, small = carried_cell("tool0", "[0.1, 0, 0.2]").arms
    assert small.mount.on == OnLink("gantry", "", "tool0", Pose.from_rpy((0.1, 0.0, 0.2), (0.0, 0.0, 0.5)))
    tool0 = link_poses(carried_cell().arm_models["gantry"].robot, gantry.home, gantry.pose)["tool0"]
    assert small.pose.position == pytest.approx(tool0.transform((0.1, 0.0, 0.2)))


@pytest.mark.parametrize(
    ("mount", "text"),
    [
        ("{kind: link, at: [0, 0]}", "a mount of kind link names the arm or the robot that carries this one, and its"),
        ("{kind: link, at: [0, 0], arm: left}", "a mount of kind link names the arm or the robot that carries this"),
        (
            "{kind: link, at: [0, 0], arm: left, robot: tandem, link: tool0}",
            "a mount of kind link names the arm or the",
        ),
        ("{kind: floor, at: [0, 0], arm: left, link: tool0}", "a mount of kind floor has no arm, robot or link; use"),
        ("{kind: link, at: [0, 0], robot: tandum, link: base}", "there is no robot 'tandum'; did you mean tandem"),
        ("{kind: link, at: [0, 0], robot: tandem, link: right_tap}", "tandem has no link 'right_tap'; did you mean"),
        ("{kind: link, at: [0, 0], arm: lift, link: tool0}", "there is no arm 'lift' above; did you mean left"),
        ("{kind: link, at: [0, 0], arm: right, link: tool0}", "there is no arm 'right' above; an arm that carries"),
        ("{kind: link, at: [0, 0], arm: left, link: tool1}", "left has no link 'tool1'; did you mean tool0"),
        ("{kind: link, at: [0, 0], arm: left, link: vacuum_gripper_link}", "left has no link 'vacuum_gripper_link'"),
        ("{kind: link, at: [0, 0], arm: old, link: base_link}", "old is the arm of 2017, which carries no other"),
    ],
)
def test_mount_on_a_link_with_a_mistake_is_refused_with_line_and_remedy(folder: Path, mount: str, text: str) -> None:
    old = "old: {mount: {kind: rail, at: [9, 0]}}"
    right = f"right: {{model: ur5.urdf, tip: tool0, mount: {mount}}}"
    robots = "  robots: {tandem: {model: tandem, at: [5, 5, 0]}}"
    lines = ["cell:", "  arms:", f"    {old}", f"    left: {{{UR5}}}", f"    {right}", robots]
    (folder / "cell.yaml").write_text("\n".join(lines))
    with pytest.raises(DescriptionError) as caught:
        load_trial([folder / "cell.yaml"])
    (problem,) = caught.value.problems
    assert str(problem).startswith(f"{folder}/cell.yaml:5: cell.arms.right.mount: {text}")


def test_what_a_file_lacks_is_refused_at_its_own_line(folder: Path) -> None:
    path = folder / "ur5.urdf"
    path.write_text(path.read_text().replace('effort="150"', 'effort="0"', 1))
    (problem,) = refusals(folder, UR5)
    assert problem.startswith("ur5.urdf:")
    assert "joint[shoulder_pan_joint]: the joint has no effort limit, or 0; write effort" in problem
    assert read(folder, f"{UR5}, limits: {{shoulder_pan_joint: {{effort: 150}}}}").joints


def test_damaged_file_of_a_model_is_refused_at_its_own_line(folder: Path) -> None:
    (folder / "ur5.urdf").write_text("<robot name='x'><link/></robot>")
    assert all(problem.startswith("ur5.urdf:") for problem in refusals(folder, UR5))


def test_settings_of_the_drives_of_2017_are_refused(folder: Path) -> None:
    own = "{arm: {servo: precise, initial_joint_states: {elbow_joint: 1.0}}}"
    with pytest.raises(DescriptionError) as caught:
        read(folder, UR5, cellwright=own)
    keys = [str(problem).partition("cellwright.")[2].partition(":")[0] for problem in caught.value.problems]
    assert keys == ["arm.servo", "arm.initial_joint_states"]
