"""A user's own part types, for tests: a mesh with its flat top off the centre, and a trial that orders them."""

from pathlib import Path

STEP_HEIGHT = 30.0
"""Height of the mesh [mm]; its base is x -50 to 50, y -25 to 25, its flat top x 0 to 50."""

_STEP = """\
v -50 -25 0
v 50 -25 0
v 50 25 0
v -50 25 0
v 0 -25 30
v 50 -25 30
v 50 25 30
v 0 25 30
f 4 3 2 1
f 5 6 7 8
f 1 2 6 5
f 2 3 7 6
f 3 4 8 7
f 4 1 5 8
"""

PARTS = {
    "my_box": "{mass: 0.4, shapes: [{box: [0.09, 0.06, 0.04], pose: {xyz: [0, 0, 0.02]}}]}",
    "my_can": "{mass: 0.5, shapes: [{cylinder: {radius: 0.035, length: 0.12}}]}",  # its origin is in its middle
    "my_step": "{mass: 0.4, shapes: [{mesh: step.obj, scale: 0.001}]}",
    "my_ball": "{mass: 0.3, shapes: [{sphere: {radius: 0.03}}]}",
    "my_anvil": "{mass: 25, shapes: [{box: [0.08, 0.08, 0.05]}]}",
}
"""Text of each type in a trial's file."""

_PLACES = ("0.1, 0.15, 0", "-0.1, 0.15, 0", "0.1, -0.15, 0", "-0.1, -0.15, 0")


def write_step(path: Path) -> Path:
    """Write the mesh, as an OBJ file in mm."""
    path.write_text(_STEP)
    return path


def write_trial(folder: Path, *types: str, roll: str = "0") -> Path:
    """Write a trial with four parts of each type in a bin of its own, and an order for one of each.

    Args:
        folder: folder of the trial.
        types: names of `PARTS`.
        roll: roll angle of the parts, in their bins and as ordered [rad].
    """
    write_step(folder / "step.obj")
    lines = ["options: {insert_models_over_bins: true}", "cellwright:", "  parts:"]
    lines += [f"    {name}: {PARTS[name]}" for name in types]
    lines += ["models_over_bins:"]
    for number, name in enumerate(types, 5):
        grid = f"xyz_start: [0.15, 0.15, 0.04], xyz_end: [0.45, 0.45, 0.04], rpy: [{roll}, 0, 0.4]"
        lines += [f"  bin{number}: {{models: {{{name}: {{{grid}, num_models_x: 2, num_models_y: 2}}}}}}"]
    lines += ["orders:", "  order_0:", "    announcement_condition: time", "    announcement_condition_value: 0"]
    lines += ["    parts:"]
    for number, name in enumerate(types):
        pose = f"{{xyz: [{_PLACES[number]}], rpy: [{roll}, 0, {number}]}}"
        lines += [f"      part_{number}: {{type: {name}, pose: {pose}}}"]
    path = folder / "own.yaml"
    path.write_text("\n".join(lines) + "\n")
    return path
