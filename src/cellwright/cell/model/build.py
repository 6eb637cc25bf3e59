"""Model of the whole cell, built from a trial, and the settings of the engine's solver."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.cell.model import furniture
from cellwright.cell.model.agv import add_agv
from cellwright.cell.model.arms import add_arms_and_robots
from cellwright.cell.model.bins import add_bin
from cellwright.cell.model.clones import clone_name, first_bodies
from cellwright.cell.model.furniture import add_housing
from cellwright.cell.model.own_models import OwnPartType, add_furniture, own_part_type
from cellwright.cell.model.own_robot import first_positions
from cellwright.cell.model.parts import PART_TYPES, PartType, add_part, add_part_meshes, part_type
from cellwright.cell.model.shelf import shelf_slot
from cellwright.cell.model.tray import add_fixed_tray
from cellwright.config.layout.arm_models import home_of, joints_of, links_by_frame, moving_links
from cellwright.config.layout.layout import Layout
from cellwright.config.trial.trial import Part, Trial
from cellwright.engine.shapes import Visuals
from cellwright.mechanism.robot_bodies import ITERATIONS
from cellwright.mechanism.welds import add_weld, find_weld, grip_name
from cellwright.util.errors import DescriptionError, UnknownNameError
from cellwright.util.pose import Pose

MAX_SHAPES = 20_000
"""Maximum number of shapes of all parts of a cell together."""
_MANY_PARTS = 400
"""Above this number the engine must not choose its memory: it would grow with the square of the number of parts."""
_MAX_MEMORY = 1 << 30
"""Memory of the engine for contacts and constraints [bytes]."""


def contact_time(timestep: float) -> float:
    """Return the time constant [s] of contacts: as stiff as the step allows.

    With the engine's default of 20 ms a part sinks 0.1 mm into its support. An arm pressed onto a part by its servos
    sinks in by millimetres.
    """
    return max(0.004, 2 * timestep)


def set_solver(spec: Any, timestep: float, friction: float = 1.0) -> None:
    """Set integrator, solver and contact defaults of a model specification.

    Args:
        spec: model specification.
        timestep: time step [s].
        friction: default coefficient of dry friction.
    """
    option = spec.option
    option.timestep = timestep
    # Of the integrators only the implicit ones are stable with stiff servos and contacts. With the fast one, 60 parts
    # that fall from 1 m in any position stay in their bins up to 4 ms; the discrete one loses some.
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    # Friction cones of the pyramidal kind are weaker along the diagonals; and elliptic ones allow stiffer friction than
    # normal forces (`impratio`), without which parts creep on a tray or in a bin.
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.impratio = 10.0
    # Newton's method: with 60 parts awake conjugate gradients take 1.2 times as long for a step, Gauss-Seidel 4 times.
    # It ends after a few iterations, so bounds from 4 to 50 and tolerances up to 1e-6 take the same time.
    option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    option.iterations = 20
    option.tolerance = 1e-8
    # With 20 line searches a kit of many contacts creeps on an accelerating AGV.
    option.ls_iterations = 50
    # 60 sleeping parts make a step 30 times as fast as 60 awake ones. Cylinders at rest turn to and fro at 1e-3 rad/s:
    # below a tolerance of 1e-4 they would never sleep.
    option.enableflags |= int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    option.sleep_tolerance = 1e-3
    # Sleep is by island. Without several contacts for a pair of convex shapes, parts rock by a millimetre.
    option.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_ISLAND | mujoco.mjtDisableBit.mjDSBL_MULTICCD)
    geom = spec.default.geom
    geom.solref = (contact_time(timestep), 1.0)
    # Friction along the surface alone: against turning on the spot as well (`condim` 4) it takes a tenth longer.
    geom.friction = (friction, 0.005, 0.0001)
    geom.condim = 3


@dataclass(frozen=True, slots=True)
class WorldPart:
    """Part and its addresses in the engine.

    Attributes:
        name: full model name, `bin7|piston_rod_part_3`; also of the body and its free joint, unless it is a clone.
        qpos: address of its position and quaternion (7 numbers) in `qpos`.
        dof: address of its velocity (6 numbers) in `qvel`.
        grips: id of the weld to each gripper, by the name of its arm or hand.
        locks: id of the weld to the tray of each AGV, by the AGV's number.
        start: its pose when a run begins, in the world frame.
        pooled: true if it waits on the shelf until it is put into play.
        shelf: its body's own slot on the shelf, for before and after it is in play.
    """

    name: str
    type: str
    body: int
    qpos: int
    dof: int
    geoms: tuple[int, ...]
    grips: Mapping[str, int]
    locks: Mapping[int, int]
    start: Pose
    pooled: bool
    shelf: Pose


@dataclass(frozen=True, slots=True)
class World:
    """Cell as a compiled model.

    Joint values are zero where the robot description says; the engine's own reset therefore stretches the arm out. Call
    `set_initial_posture` after it.

    Attributes:
        model: shapes that are touched or measured.
        visuals: shapes that are only seen.
        parts: every part with a body of its own, in the order of the model: those in play first, then those that wait.
        clones: names and types of the belt's clones.
        bodies: bodies that the clones take in turn, in the order of the model, after the parts.
        initial_qpos: positions when a run begins, shape (nq,).
        initial_ctrl: setpoints that hold the arm and the AGVs there, shape (nu,).
        own_types: the trial's user-defined part types, by name.
        arm_links: frames of the links that the joints of arms move, by the names of the links in the engine.
    """

    model: Any
    visuals: Visuals
    parts: tuple[WorldPart, ...]
    clones: tuple[tuple[str, str], ...]
    bodies: tuple[WorldPart, ...]
    initial_qpos: NDArray[np.float64]
    initial_ctrl: NDArray[np.float64]
    own_types: Mapping[str, OwnPartType]
    arm_links: Mapping[str, str]

    def set_initial_posture(self, data: Any) -> None:
        """Write the positions and setpoints that a run begins with into an `MjData`."""
        data.qpos[:] = self.initial_qpos
        data.ctrl[:] = self.initial_ctrl

    def initial_data(self) -> Any:
        """Return the engine's data as a run begins, with the poses of all bodies and shapes."""
        data = mujoco.MjData(self.model)
        self.set_initial_posture(data)
        mujoco.mj_kinematics(self.model, data)
        return data


@dataclass(frozen=True, slots=True)
class _Planned:
    """Part before it has an address in a model."""

    name: str
    kind: PartType
    start: Pose | None


@dataclass(frozen=True, slots=True)
class _Specified:
    """Cell before the engine has compiled it: the specification, and what is planned on the shelf's slots.

    The first of these are `parts`; the others are bodies for the belt's clones.
    """

    spec: Any
    visuals: Visuals
    own_types: Mapping[str, OwnPartType]
    planned: Sequence[_Planned]
    slots: Sequence[Pose]
    parts: int
    clones: tuple[tuple[str, str], ...]


def build_world(trial: Trial, bodies: Iterable[str] | None = None) -> World:
    """Turn a trial into a model. The same arguments make the same model, byte for byte.

    The trial itself decides whether bin parts and extra parts are in play.

    Args:
        trial: the trial.
        bodies: types of the bodies for clones of the belt; None: those that a run begins with. Further bodies at the
            end leave all ids and addresses of the others as they are.

    Raises:
        DescriptionError: there are too many shapes in it, or the engine refuses the cell as a whole.
        UnknownNameError: a part type, a frame, a belt or an arm joint that does not exist.
        ModelFileError: a user-defined model that the engine cannot use.
    """
    made = _specified(trial, bodies)
    model = _compiled(made.spec, trial.name, has_clones=bool(made.clones))
    located = tuple(_locate(model, part, slot, trial) for part, slot in zip(made.planned, made.slots, strict=True))
    qpos, ctrl = first_pose(model, trial)
    return World(
        model=model,
        visuals=made.visuals,
        parts=located[: made.parts],
        clones=made.clones,
        bodies=located[made.parts :],
        initial_qpos=qpos,
        initial_ctrl=ctrl,
        own_types=made.own_types,
        arm_links={name: arm.frame_of(name) for arm in trial.arms for name in moving_links(arm, trial.arm_models)},
    )


def cell_specification(trial: Trial) -> Any:
    """Return the engine's specification of a cell, as `build_world` compiles it, with the posture that a run begins in.

    That posture is the key frame `home`.

    Raises:
        As `build_world`.
    """
    made = _specified(trial, None)
    model = _compiled(made.spec, trial.name, has_clones=bool(made.clones))
    made.spec.option.disableflags, made.spec.option.jacobian = model.opt.disableflags, model.opt.jacobian
    qpos, ctrl = first_pose(model, trial)
    made.spec.add_key(name="home", qpos=qpos, ctrl=ctrl)
    made.spec.compile()
    return made.spec


def _specified(trial: Trial, bodies: Iterable[str] | None) -> _Specified:
    """Return the cell of a trial as a specification of the engine; `build_world` has arguments and errors."""
    spec, visuals = mujoco.MjSpec(), Visuals()
    layout = trial.layout
    spec.modelname = trial.name
    spec.compiler.degree = False
    timestep = trial.settings.timestep[0] / trial.settings.timestep[1]
    set_solver(spec, timestep, trial.circumstances.friction)
    if layout.robots:
        spec.option.iterations = ITERATIONS
    add_arms_and_robots(spec, visuals, trial, contact_time(timestep))
    for agv in trial.carriers:
        add_agv(spec, visuals, agv)
    own = {name: own_part_type(name, model) for name, model in trial.part_models.items()}
    kinds = {name: part_type(name) for name in PART_TYPES} | {name: each.kind for name, each in own.items()}
    planned = list(_plan(trial, kinds))
    for belt_part in trial.belt_parts:
        layout.belt(belt_part.belt)  # raises for an unknown name
    clones = tuple((clone_name(name), _kind(kinds, kind)) for name, kind in trial.belt_clones())
    everything = [*(part.kind for part in planned), *(kind for _, kind in clones)]
    if (shapes := sum(len(kind.solid) + len(kind.seen) for kind in everything)) > MAX_SHAPES:
        raise DescriptionError(
            [f"{trial.name}: the parts may have at most {MAX_SHAPES} shapes in total (got {shapes})"]
        )
    _add_fixed(spec, visuals, layout, len(everything))
    links = links_by_frame(trial.arms, trial.arm_models)
    for sensor in trial.sensors:
        add_housing(visuals, sensor, links)
    add_furniture(spec, visuals, trial.furniture)
    add_part_meshes(visuals)
    for each in own.values():
        each.form.add_meshes(spec, visuals)
    planned += _plan_bodies(first_bodies(trial) if bodies is None else bodies, kinds)
    slots = [shelf_slot(layout.shelf, k, len(everything), part.kind.bottom) for k, part in enumerate(planned)]
    for part, slot in zip(planned, slots, strict=True):
        add_part(spec, visuals, part.name, part.kind, part.start or slot)
        _add_holds(spec, part.name, trial, contact_time(timestep))
    if len(everything) > _MANY_PARTS:
        spec.memory = _MAX_MEMORY
    names = tuple((name, kind.name) for name, kind in clones)
    return _Specified(spec, visuals, own, planned, slots, len(everything) - len(clones), names)


def _add_fixed(spec: Any, visuals: Visuals, layout: Layout, slots: int) -> None:
    furniture.add_floor(spec, visuals, layout)
    for each in layout.bins:
        add_bin(spec, visuals, each)
    for belt in layout.belts:
        furniture.add_conveyor(spec, visuals, belt)
    for belt in layout.belts:
        if belt.wall is not None:
            furniture.add_deletion_wall(spec, belt, belt.wall)
    for structure in layout.structure:
        furniture.add_structure(spec, visuals, structure)
    for tray in layout.trays:
        add_fixed_tray(spec, visuals, tray)
    furniture.add_shelf(spec, slots, layout)


def _compiled(spec: Any, name: str, *, has_clones: bool) -> Any:
    try:
        model = spec.compile()
    except ValueError as error:
        reason = " ".join(str(error).split())
        raise DescriptionError([f"{name}: the engine cannot build this cell: {reason}"]) from None
    # Without the flag the engine would look for dry friction in every joint in every step.
    if not model.dof_frictionloss.any():
        model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_FRICTIONLOSS)
    # The belt stands still in the model; without the flag the engine would ignore later changes.
    model.flg_surfacevel = True
    # Dense matrices, which the engine uses for few bodies, round differently with more of them: a model that grows with
    # the belt's clones would continue with other digits.
    if has_clones:
        model.opt.jacobian = mujoco.mjtJacobian.mjJAC_SPARSE
    return model


def demo_origin(trial: Trial) -> str:
    """Return the origin in the names of the demo tray's parts: `populate_kit_tray_1`, after the first tray."""
    return f"populate_{trial.stations[0].tray_name}" if trial.stations else ""


def _plan(trial: Trial, kinds: Mapping[str, PartType]) -> Iterator[_Planned]:
    """Yield the parts that stand in the cell when the trial begins, then those of the demo tray."""
    frames = trial.reference_frames
    part: Part
    for part in (*trial.bin_parts, *trial.extra_parts):
        if part.frame not in frames:
            raise UnknownNameError("frame", part.frame, frames)
        yield _Planned(part.name, _kind(kinds, part.type), frames[part.frame] @ part.pose)
    for name, ordered in trial.demo_clones():
        yield _Planned(f"{demo_origin(trial)}|{name}", kinds[ordered.type], None)


def _plan_bodies(types: Iterable[str], kinds: Mapping[str, PartType]) -> Iterator[_Planned]:
    """Yield the bodies for clones of the belt."""
    counts: Counter[str] = Counter()
    for name in types:
        yield _Planned(f"clone|{name}_{counts[name]}", _kind(kinds, name), None)
        counts[name] += 1


def _kind(kinds: Mapping[str, PartType], name: str) -> PartType:
    if name not in kinds:
        raise UnknownNameError("part type", name, kinds)
    return kinds[name]


def _add_holds(spec: Any, part: str, trial: Trial, time: float) -> None:
    """Add the inactive welds that can hold a part: those of the grippers, and `lockN|PART` to the tray of AGV N."""
    for arm in trial.arms:
        if arm.tool.kind != "none":
            add_weld(spec, grip_name(part, arm.namespace), arm.holder, part, time)
    for robot in trial.layout.robots:
        for hand in robot.hands:
            add_weld(spec, grip_name(part, hand.name), robot.prefix + hand.link, part, time)
    for agv in trial.carriers:
        add_weld(spec, f"lock{agv.number}|{part}", agv.tray_link, part, time)


def _locate(model: Any, part: _Planned, slot: Pose, trial: Trial) -> WorldPart:
    """Look up the addresses of a part in the compiled model of a trial."""
    body = model.body(part.name).id
    joint = model.joint(part.name)
    first = int(model.body_geomadr[body])
    geoms = range(first, first + int(model.body_geomnum[body]))

    locks = {each.number: int(model.equality(f"lock{each.number}|{part.name}").id) for each in trial.carriers}
    holders = {arm.name: arm.namespace for arm in trial.arms}
    holders |= {hand.name: hand.name for robot in trial.layout.robots for hand in robot.hands}
    grips = {
        name: weld
        for name, of_weld in holders.items()
        if (weld := find_weld(model, grip_name(part.name, of_weld))) is not None
    }
    return WorldPart(
        name=part.name,
        type=part.kind.name,
        body=int(body),
        qpos=int(joint.qposadr[0]),
        dof=int(joint.dofadr[0]),
        geoms=tuple(geom for geom in geoms if model.geom_contype[geom]),
        grips=grips,
        locks=locks,
        start=part.start or slot,
        pooled=part.start is None,
        shelf=slot,
    )


def first_pose(model: Any, trial: Trial) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the positions and setpoints that a run begins with. AGVs are at home, at 0, and grippers are open."""
    qpos = np.array(model.qpos0)
    ctrl = np.zeros(model.nu)
    for arm in trial.arms:
        for name, usual in home_of(arm, joints_of(arm, trial.arm_models)).items():
            position = trial.initial_joint_states.get(arm.start_prefix + name, usual)
            qpos[model.joint(arm.prefix + name).qposadr[0]] = position
            ctrl[model.actuator_ctrladr[model.actuator(arm.prefix + name).id]] = position
        if arm.tool.fingers is not None:
            for name in arm.gripper_names.joints:
                qpos[model.joint(name).qposadr[0]] = arm.tool.fingers.opening / 2
                ctrl[model.actuator_ctrladr[model.actuator(name).id]] = arm.tool.fingers.opening / 2
    for name, position in first_positions(trial).items():
        qpos[model.joint(name).qposadr[0]] = position
        ctrl[model.actuator_ctrladr[model.actuator(name).id]] = position
    return qpos, ctrl
