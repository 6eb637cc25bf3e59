"""Checks of a cell with culling, tick by tick, against one without that continues from the same state.

Impacts amplify any difference, so that two whole runs part for good reasons. Here the cell without culling takes the
state of the other every `WINDOW` ticks, and everything in it collides. A difference larger than `MAX_OFF` is chaos if
it began, from equal states, with equal contacts in both: then the solver's rounding made it. Else it is chaos only if
the cell without culling differs as much from itself, shaken by `SHAKE`. `drift` compares whole runs.
"""

from __future__ import annotations

import copy
from collections import Counter, deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.engine.engine_state import CHANGING_FIELDS
from tests.cell.devices.culling_scenes import Scene, SceneRun
from tests.support.places import BELT

WINDOW = 100
"""Ticks after which the cell without culling starts from the state of the other again."""
MAX_OFF = 0.001
"""Maximum distance [m] within a window. The solver's tolerance alone makes an impact differ by 1e-4 m/s."""
CHAOS = 0.1
"""A difference is chaos if that between runs without culling, shaken slightly, is at least this share of it."""
SHAKE = np.array((1e-5, 1e-5, 1e-5, 5e-4, 5e-4, 5e-4))
"""Changes of velocities [m/s, rad/s] that show how much impacts amplify."""
SHAKE_EVERY, SHAKEN = 5, 24  # ticks, runs; each second run is shaken a tenth as much
TIMESTEP = 0.002  # [s]
SAME = 1e-9  # [m]: a part that is further off has parted
MIN_DEPTH = 1e-6  # [m], of a contact that must not be missed
FIRST = 10
"""Ticks of a first touch over which its impulse counts."""
APART = 50
"""Ticks without contact after which a touch is a first one."""
SAME_IMPULSE, MIN_IMPULSE = 0.05, 0.002  # share, [N s]


@dataclass
class Findings:
    """Problems of a scene, and how often culling acted in it: ticks, and first touches that were compared."""

    problems: list[str] = field(default_factory=list)
    ticks: int = 0
    closed: int = 0
    gliding: int = 0
    touches: int = 0
    chaos: Counter[str] = field(default_factory=Counter)


class CullingCheck:
    """A scene with culling, compared with one that has none."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.culled = SceneRun(scene, culling=True)
        self.full = SceneRun(scene, culling=False)
        self.found = Findings()
        self._model = self.full.simulation.model
        self._scratch = mujoco.MjData(self._model)
        self._parts = self.culled.parts
        self._bodies = np.array([part.body for part in self._parts])
        self._rows = np.array([part.qpos for part in self._parts])[:, None] + np.arange(3)
        self._body_of = np.asarray(self._model.geom_bodyid, dtype=np.int64)
        self._collides = (self._model.body_contype | self._model.body_conaffinity) != 0
        self._belt = int(self._body_of[self._model.geom(BELT.body).id])
        self._movable = self._model.body_treeid >= 0
        self._touched = {True: self._no_touches(), False: self._no_touches()}
        self._starts: deque[State] = deque(maxlen=2)
        self._parted: dict[int, bool] = {}
        """For each part that has parted in this window: whether its contacts in that step were equal."""
        self._parted_before: dict[int, bool] = {}

    def run(self) -> Findings:
        """Play the scene to its end; return what was found."""
        found = self.found
        while self.culled.tick < self.scene.ticks and len(found.problems) < 3:
            if self.culled.tick % WINDOW == 0:
                self._check_support()
                self._starts.append(copy_of(self.culled))
                continue_from(self.full, self._starts[-1])
                self._parted_before, self._parted = self._parted, {}
            self.culled.command()
            self.full.command()
            before = np.array(self.culled.simulation.data.qpos)
            was_awake = self._awake()
            self.culled.cell.step()
            self.full.cell.step()
            self._count()
            self._note_parting()
            self._check_contacts(before, was_awake)
            self._check_places()
            self._check_touches()
        return found

    def _report(self, problem: str) -> None:
        self.found.problems.append(f"tick {self.culled.tick}: {problem}")

    def _name(self, body: int) -> str:
        return str(self._model.body(body).name) or "world"

    def _is_culled(self) -> NDArray[np.bool_]:
        """Return for each body whether it is left out of collision detection."""
        model = self.culled.simulation.model
        out: NDArray[np.bool_] = self._collides & ((model.body_contype | model.body_conaffinity) == 0)
        return out

    def _awake(self) -> NDArray[np.bool_]:
        """Return for each body whether it is awake."""
        trees = self._model.body_treeid
        awake: NDArray[np.bool_] = (trees >= 0) & (self.culled.simulation.data.tree_asleep[trees] < 0)
        return awake

    def _count(self) -> None:
        out, awake = self._is_culled()[self._bodies], self._awake()[self._bodies]
        held = np.array([self.culled.is_held(number) for number in range(len(self._parts))])
        self.found.ticks += 1
        self.found.closed += bool((out & ~awake).any())
        self.found.gliding += bool((out & awake & ~held).any())

    def _all_contacts(self, qpos: NDArray[np.float64]) -> Iterator[tuple[int, int, float, NDArray[np.float64]]]:
        """Yield bodies, depth [m] and normal of each contact with everything colliding."""
        model, data = self._model, self._scratch
        data.qpos[:] = qpos
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_collision(model, data)
        pairs, depths, frames = self._body_of[data.contact.geom], -data.contact.dist, data.contact.frame
        for (one, other), depth, frame in zip(pairs.tolist(), depths.tolist(), frames, strict=True):
            yield one, other, depth, frame[:3]

    def _check_contacts(self, qpos: NDArray[np.float64], was_awake: NDArray[np.bool_]) -> None:
        """Report what the step just made should have collided and did not."""
        out, awake = self._is_culled(), self._awake() & was_awake
        if not (out & awake).any() and not out.any():
            return
        carriers = self._carriers(out & awake)
        for one, other, depth, _ in self._all_contacts(qpos):
            if depth < MIN_DEPTH or not (out[one] or out[other]) or not (awake[one] or awake[other]):
                continue
            if other in carriers.get(one, ()) or one in carriers.get(other, ()):
                continue
            self._report(f"{self._name(one)} and {self._name(other)} meet unseen, {depth * 1e3:.4f} mm deep")

    def _carriers(self, riding: NDArray[np.bool_]) -> dict[int, set[int]]:
        """Return by part that rides or is held what it may meet unseen: the belt, or what a weld holds it to."""
        model, carriers = self._model, {body: {self._belt} for body in self._bodies[riding[self._bodies]].tolist()}
        for weld in np.flatnonzero(self.culled.simulation.data.eq_active).tolist():
            pair = {int(model.eq_obj1id[weld]), int(model.eq_obj2id[weld])}
            for body in pair & set(carriers):
                carriers[body] = pair - {body}
        return carriers

    def _check_support(self) -> None:
        """Report parts that sleep or glide with nothing below them, nor on both sides."""
        out, awake = self._is_culled(), self._awake()
        standing = {body for body in self._bodies.tolist() if out[body] or not awake[body]}
        held = {part.body for number, part in enumerate(self._parts) if self.culled.is_held(number)}
        in_play = {part.body for part in self._parts if part.name in self.culled.cell.parts.in_play}
        floating = (standing - held) & in_play
        supports: dict[int, list[NDArray[np.float64]]] = {}
        for one, other, _, normal in self._all_contacts(np.array(self.culled.simulation.data.qpos)):
            for body, towards in ((one, -normal), (other, normal)):
                if body in floating:
                    supports.setdefault(body, []).append(towards)
        for body, normals in supports.items():
            is_pinched = min(float(each @ other) for each in normals for other in normals) < -0.5
            if is_pinched or max(each[2] for each in normals) > 0.2:
                floating.discard(body)
        for body in floating:
            self._report(
                f"{self._name(body)} has nothing below it; {'glides' if out[body] and awake[body] else 'sleeps'}"
            )

    def _note_parting(self) -> None:
        """Note parts that have just parted, and whether both runs had the same contacts of them in this step."""
        culled, full = self.culled.simulation.data, self.full.simulation.data
        off = np.linalg.norm(culled.qpos[self._rows] - full.qpos[self._rows], axis=1)
        for number in np.flatnonzero(off > SAME).tolist():
            if number not in self._parted:
                one, other = (
                    {
                        frozenset(pair)
                        for pair in data.contact.geom.tolist()
                        if self._bodies[number] in self._body_of[pair]
                    }
                    for data in (culled, full)
                )
                self._parted[number] = bool(one) and one == other

    def _check_places(self) -> None:
        """Report parts that have moved otherwise than without culling, and not by chaos."""
        off = np.linalg.norm(
            self.culled.simulation.data.qpos[self._rows] - self.full.simulation.data.qpos[self._rows], axis=1
        )
        for number in np.flatnonzero(off > MAX_OFF).tolist():
            part = self._parts[number]
            if part.name not in self.culled.cell.parts.in_play:
                continue
            if (
                self._parted.get(number)
                or self._strays(number, self._starts[-1], self.culled.tick)[0] > CHAOS * off[number]
            ):
                self.found.chaos[part.name] += 1
            else:
                self._report(f"{part.name} is {off[number] * 1e3:.3f} mm off after {self.culled.tick % WINDOW} ticks")
        if (off > MAX_OFF).any():
            continue_from(self.full, copy_of(self.culled))
            self._parted_before, self._parted = self._parted, {}

    def _strays(self, number: int, start: State, first: int) -> tuple[float, float]:
        """Return how far a part strays without culling, from a start, when what is awake is shaken on the way.

        The second figure is how much the impulse on it since the tick `first` varies [m, N s].

        A part that rides the belt trembles, and the solver ends a violent contact in one of several ways. So the shakes
        are of the size of this trembling or smaller, and repeated: a part that jams may take one of two ways, and few
        shakes all the same one.
        """
        body, ends = self._bodies[number], []
        for seed in range(1 + SHAKEN):
            run, by = SceneRun(self.scene, culling=False), np.random.default_rng(seed)
            continue_from(run, start)
            impulse = 0.0
            while run.tick < self.culled.tick:
                if seed and run.tick % SHAKE_EVERY == 0:
                    shake_awake(run, by, 1.0 if seed % 2 else 0.1)
                run.step()
                if first <= run.tick < first + FIRST:
                    impulse += self._forces(run).get(body, 0.0) * TIMESTEP
            ends.append((run.simulation.data.qpos[self._rows[number]].copy(), impulse))
        away, push = (
            max(float(np.linalg.norm(each - unshaken)) for each in rest) for unshaken, *rest in zip(*ends, strict=True)
        )
        return away, push

    def _forces(self, run: SceneRun) -> dict[int, float]:
        """Return the forces [N] of contacts among movable bodies on each of them."""
        data = run.simulation.data
        pairs, rows = self._body_of[data.contact.geom], data.contact.efc_address
        moving = self._movable[pairs].all(axis=1) & (rows >= 0)
        forces: dict[int, float] = {}
        for (one, other), row in zip(pairs[moving].tolist(), rows[moving].tolist(), strict=True):
            for body in (one, other):
                forces[body] = forces.get(body, 0.0) + float(data.efc_force[row])
        return forces

    def _no_touches(self) -> dict[int, tuple[int, int, float]]:
        """Return no touches yet: body -> first and last tick of a touch, impulse of its first ticks [N s]."""
        return {}

    def _check_touches(self) -> None:
        """Report first touches of parts, by others or the arm, that push otherwise than without culling."""
        tick = self.culled.tick
        for is_culled, run in ((True, self.culled), (False, self.full)):
            touched = self._touched[is_culled]
            for body, force in self._forces(run).items():
                first, last, impulse = touched.get(body, (tick, tick, 0.0))
                if tick - last > APART:
                    first, impulse = tick, 0.0
                touched[body] = (first, tick, impulse + force * TIMESTEP * (tick - first < FIRST))
        for number, body in enumerate(self._bodies.tolist()):
            pair = [self._touched[side].get(body, (-1, -1, 0.0)) for side in (True, False)]
            if tick - min(each[0] for each in pair) != FIRST + 1 or abs(pair[0][0] - pair[1][0]) > 1:
                continue
            self.found.touches += 1
            one, other = pair[0][2], pair[1][2]
            if abs(one - other) <= SAME_IMPULSE * max(one, other) + MIN_IMPULSE:
                continue
            first = min(each[0] for each in pair)
            start = self._starts[-1 if first > tick - tick % WINDOW else 0]
            has_parted = self._parted.get(number) or self._parted_before.get(number)
            if has_parted or self._strays(number, start, first)[1] > CHAOS * abs(one - other):
                self.found.chaos[self._parts[number].name] += 1  # it jams, and chatters in one of several ways
            else:
                self._report(
                    f"{self._name(body)} [{number}] is first touched with {one:.4f} N s, {other:.4f} N s without"
                )


MAX_DRIFT, SAME_DRIFT = 0.002, 0.0005
"""Maximum distance [m] between two whole runs; and between two without culling, where nothing has been amplified."""
DRIFT_SHAKEN = 4


def drift(scene: Scene, every: int = 25) -> list[str]:
    """Play a whole scene with culling and without; return where they differ although impacts do not explain it."""
    culled, full = _positions(scene, every, culling=True), _positions(scene, every, culling=False)
    off = np.linalg.norm(culled - full, axis=2)
    if not (off > MAX_DRIFT).any():
        return []
    shaken = [_positions(scene, every, culling=False, shake=seed) for seed in range(1, 1 + DRIFT_SHAKEN)]
    amplified = np.max([np.linalg.norm(each - full, axis=2) for each in shaken], axis=0)
    has_parted = np.maximum.accumulate(amplified, axis=0) > SAME_DRIFT
    return [
        f"{scene.part(number)} is {off[row, number] * 1e3:.3f} mm off at tick {row * every}"
        for row, number in np.argwhere((off > MAX_DRIFT) & ~has_parted).tolist()
    ]


def _positions(scene: Scene, every: int, *, culling: bool, shake: int = 0) -> NDArray[np.float64]:
    """Return the positions [m] of all parts, shape (samples, parts, 3); 0 for those out of play."""
    run, by = SceneRun(scene, culling=culling), np.random.default_rng(shake)
    rows = np.array([part.qpos for part in run.parts])[:, None] + np.arange(3)
    positions = []
    while run.tick < scene.ticks:
        if run.tick % every == 0:
            in_play = np.array([part.name in run.cell.parts.in_play for part in run.parts])
            positions.append(run.simulation.data.qpos[rows] * in_play[:, None])
        if shake and run.tick % SHAKE_EVERY == 0:
            shake_awake(run, by)
        run.step()
    return np.array(positions)


def shake_awake(run: SceneRun, by: np.random.Generator, scale: float = 1.0) -> None:
    """Change the velocities of the parts that are awake, at random by up to `scale` times `SHAKE`."""
    model, data = run.simulation.model, run.simulation.data
    for part in run.parts:
        change = by.uniform(-1.0, 1.0, 6) * SHAKE * scale
        if data.tree_asleep[model.body_treeid[part.body]] < 0:
            data.qvel[part.dof : part.dof + 6] += change


@dataclass(frozen=True)
class State:
    """State of a run for one without culling."""

    data: mujoco.MjData
    fields: dict[str, NDArray[np.float64]]
    state: dict[str, Any]


def copy_of(run: SceneRun) -> State:
    """Return the state of a run, for one in which everything collides, and no weight is held up."""
    simulation = run.simulation
    model = simulation.model
    fields = {name: getattr(model, name).copy() for name in CHANGING_FIELDS if not name.startswith("body_")}
    return State(copy.copy(simulation.data), fields, copy.deepcopy(simulation.get_state()))


def continue_from(run: SceneRun, state: State) -> None:
    """Continue a run without culling from a state."""
    simulation = run.simulation
    mujoco.mj_copyData(simulation.data, simulation.model, state.data)
    for name, field_values in state.fields.items():
        getattr(simulation.model, name)[:] = field_values
    values = copy.deepcopy(state.state)
    devices = values["devices"].items()
    simulation.set_state({**values, "devices": {name: each for name, each in devices if name in simulation.devices}})
