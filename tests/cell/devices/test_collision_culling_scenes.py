"""Collision culling changes nothing: random scenes with it and without it, in detail (`culling_checks`) and as a whole.

`CELLWRIGHT_CULLING_SCENES=1000` plays that many scenes in each test; the usual run has a few.
"""

from __future__ import annotations

import os
import random
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import HealthCheck, Phase, given, settings

from cellwright.engine.device import Device
from cellwright.engine.snapshot import read_checkpoint, restore_snapshot, take_snapshot, write_checkpoint
from tests.cell.devices.culling_checks import CullingCheck, Findings, drift
from tests.cell.devices.culling_scenes import Command, Push, Scene, SceneRun, Spot, scenes
from tests.support.places import BIN_SURFACE
from tests.support.watching import WATCHERS, Watcher

SCENES = int(os.environ.get("CELLWRIGHT_CULLING_SCENES", "6"))

pytestmark = pytest.mark.slow

many = settings(
    max_examples=SCENES,
    phases=[Phase.reuse, Phase.generate, *([Phase.shrink] if SCENES > 50 else [])],  # it takes minutes
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.large_base_example],
)
# Their scenes are only two in the usual run, so the shares in which culling acts scatter more.
few = settings(many, max_examples=max(2, SCENES // 10))

ON_BIN_7 = Scene(0, 1.0, (("gear_part", Spot("bin7", 0.0, 0.0, 0.0003, 0.0, 0.0)),), (), (), 400)


def out_of_collision(run: SceneRun) -> Counter[str]:
    """Count a tick in which something is left out of collision detection, asleep (`closed`) or riding (`gliding`)."""
    model, data = run.simulation.model, run.simulation.data
    is_out = [
        (model.body_contype[part.body] | model.body_conaffinity[part.body]) == 0 and not run.is_held(number)
        for number, part in enumerate(run.parts)
    ]
    asleep = [data.tree_asleep[model.body_treeid[part.body]] >= 0 for part in run.parts]
    states = {"closed" if sleeps else "gliding" for out, sleeps in zip(is_out, asleep, strict=True) if out}
    return Counter(states)


def assert_acting(acting: Counter[str], total: str, *, closed: float, gliding: float) -> None:
    """Assert that culling acted in these shares of a total; else the test would show nothing."""
    assert acting["closed"] >= closed * acting[total], acting
    assert acting["gliding"] >= gliding * acting[total], acting


def test_collision_culling_random_scenes_collide_rest_and_push_as_without() -> None:
    """And it acts: in these scenes zones are closed, and parts glide, in a good share of the ticks."""
    found: list[Findings] = []

    @many
    @given(scenes())
    def check(scene: Scene) -> None:
        found.append(CullingCheck(scene).run())
        assert not found[-1].problems, found[-1].problems

    check()
    assert sum(each.touches for each in found) >= len(found)
    acting = Counter(
        ticks=sum(each.ticks for each in found),
        closed=sum(each.closed for each in found),
        gliding=sum(each.gliding for each in found),
    )
    assert_acting(acting, "ticks", closed=0.3, gliding=0.15)


@many
@given(scenes(ticks=2500))
def test_collision_culling_whole_run_stays_within_two_millimetres_until_impacts_amplify(scene: Scene) -> None:
    assert drift(scene) == []


@few
@given(scenes())
def test_collision_culling_two_runs_have_equal_hashes(scene: Scene) -> None:
    one, other = SceneRun(scene, culling=True), SceneRun(scene, culling=True)
    while one.tick < scene.ticks:
        one.step()
        other.step()
        if one.tick % 20 == 0:
            assert one.simulation.state_hash() == other.simulation.state_hash(), one.tick


def test_collision_culling_run_restored_in_memory_has_equal_hashes() -> None:
    acting: Counter[str] = Counter()

    @few
    @given(scenes())
    def check(scene: Scene) -> None:
        run, other = SceneRun(scene, culling=True), SceneRun(scene, culling=True)
        chosen = random.Random(scene.ticks).sample(range(1, scene.ticks - 30), 50)
        hashes, snapshots = {}, {}
        while run.tick < scene.ticks:
            if run.tick in chosen:
                snapshots[run.tick] = take_snapshot(run.simulation)
                acting.update(out_of_collision(run) + Counter(["snapshots"]))
            if run.tick in chosen or run.tick - 1 in chosen or run.tick % 10 == 0:
                hashes[run.tick] = run.simulation.state_hash()
            run.step()
        for tick in chosen:
            restore_snapshot(other.simulation, snapshots[tick])
            assert other.simulation.state_hash() == hashes[tick], tick
            while other.tick < tick + 30:
                other.step()
                if other.tick in hashes:
                    assert other.simulation.state_hash() == hashes[other.tick], (tick, other.tick)

    check()
    assert_acting(acting, "snapshots", closed=0.1, gliding=0.1)


def test_collision_culling_run_restored_from_disk_has_equal_hashes() -> None:
    acting: Counter[str] = Counter()

    @few
    @given(scenes(ticks=2500))
    def check(scene: Scene) -> None:
        run, other = SceneRun(scene, culling=True), SceneRun(scene, culling=True)
        by = random.Random(scene.ticks)
        chosen = [by.randint(begin + 300, begin + 600) for begin in range(0, scene.ticks - 600, 600)]
        with TemporaryDirectory() as folder:
            path = Path(folder) / "checkpoint.npz"
            while run.tick < scene.ticks:
                if run.tick in chosen:
                    acting.update(out_of_collision(run) + Counter(["checkpoints"]))
                    write_checkpoint(run.simulation, path)
                    read_checkpoint(other.simulation, path)
                run.step()
                if run.tick > chosen[0]:
                    other.step()
                    if run.tick % 20 == 0 or run.tick - 1 in chosen:
                        assert other.simulation.state_hash() == run.simulation.state_hash(), run.tick

    check()
    assert_acting(acting, "checkpoints", closed=0.1, gliding=0.1)


@pytest.mark.parametrize("watch", WATCHERS)
def test_collision_culling_watched_run_has_equal_hashes(watch: Watcher) -> None:
    @few
    @given(scenes())
    def check(scene: Scene) -> None:
        alone, watched = SceneRun(scene, culling=True), SceneRun(scene, culling=True)
        with TemporaryDirectory() as folder:
            watch(watched.cell, Path(folder))
            while alone.tick < scene.ticks:
                alone.step()
                watched.step()
                if alone.tick % 20 == 0:
                    assert alone.simulation.state_hash() == watched.simulation.state_hash(), alone.tick

    check()


def test_collision_culling_force_on_part_about_to_ride_lets_it_fall_back_on_belt() -> None:
    disk = ("disk_part", Spot("belt", 0.0, 0.0, 0.0003, 0.0, 0.0))
    for begin in range(20, 40):
        pushes = (Push(begin, begin + 1, 0, (0.0, 0.0, 15.0)),)
        assert drift(Scene(0, 1.0, (disk,), (Command(0, "power", (100.0,)),), pushes, 100), every=5) == []


class ForgottenBin(Device):
    """A defect: bin 7 is left out of collision detection for good."""

    def before_step(self) -> None:
        model = self.simulation.model
        model.body_contype[model.body("bin7").id] = 0


class FloatingPart(Device):
    """A defect: a part is lifted, and then held up by a force, like one that rides the belt."""

    def before_step(self) -> None:
        model, data = self.simulation.model, self.simulation.data
        body = model.body("scene|gear_part_1").id
        if self.simulation.clock.tick == 99:
            data.qpos[model.jnt_qposadr[model.body_jntadr[body]] + 2] += 0.02
            model.body_contype[body] = model.body_conaffinity[body] = 0
            data.xfrc_applied[body, 2] = 9.81 * model.body_mass[body]


@pytest.mark.parametrize(
    ("defect", "problem"),
    [(ForgottenBin("defect"), "scene|gear_part_1 and bin7 meet unseen"), (FloatingPart("defect"), "nothing below it")],
)
def test_culling_check_cell_with_defect_reports_it(defect: Device, problem: str) -> None:
    check = CullingCheck(ON_BIN_7)
    check.culled.simulation.add(defect)
    assert problem in " ".join(check.run().problems)


def test_body_out_of_collision_detection_meets_nothing() -> None:
    """The engine's rule that culling rests on: 0 in both fields of a body leaves it out, whatever its geoms say."""
    run = SceneRun(ON_BIN_7, culling=False)
    body = run.parts[0].body
    run.simulation.model.body_contype[body] = run.simulation.model.body_conaffinity[body] = 0
    for _ in range(50):
        run.step()
    pairs = run.simulation.model.geom_bodyid[run.simulation.data.contact.geom]
    assert not (pairs == body).any()
    assert run.simulation.data.qpos[run.parts[0].qpos + 2] < BIN_SURFACE - 0.04
