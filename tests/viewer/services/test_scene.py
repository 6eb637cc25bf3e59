"""What is to be seen, as guests are told it: whole, at any time, and without a trace in what is looked at."""

import hashlib
import json
from base64 import b64decode

import numpy as np
import pytest

from cellwright.cell.cell import Cell
from cellwright.engine.rate_control import RateControl
from cellwright.middleware.wire.frames import Frame as Said
from cellwright.middleware.wire.frames import Kind
from cellwright.rendering.scene.scene import decode_frame, decode_scene
from cellwright.viewer.services import scene as onlookers
from cellwright.viewer.services.control import Control
from cellwright.viewer.services.names import FRAME, SCENE
from cellwright.viewer.services.scene import SceneServices
from tests.cells import KITTING, WHOLE
from tests.middleware.server.talk import served


def test_a_guest_is_told_the_scene_and_where_it_is() -> None:
    cell = Cell(KITTING, competition=False)
    with served(cell) as hall:
        onlookers.offer_viewer_services(hall.server, cell, lambda _: {}, Control(RateControl()))
        guest = hall.guest()
        told = guest.ask(Said(Kind.CALL, 5, SCENE, payload=b"{}")).json()
        data = b64decode(told["scene"])
        assert told["digest"] == hashlib.sha256(data).hexdigest()
        scene = decode_scene(data)
        assert scene.name == cell.name
        cell.step()
        found = guest.ask(Said(Kind.CALL, 6, FRAME, payload=json.dumps({"anything": 1}).encode())).json()
    assert (found["time"], found["tick"], found["digest"]) == (cell.simulation.now, 1, told["digest"])
    frame = decode_frame(b64decode(found["frame"]))
    assert frame.time == cell.simulation.now
    assert len(frame.poses) == len(scene.bodies)
    tray = scene.bodies.index("agv1::kit_tray_1::kit_tray_1::tray")
    body = cell.simulation.data.body("agv1::kit_tray_1::kit_tray_1::tray")
    np.testing.assert_allclose(frame.poses[tray, :3], body.xpos, atol=1e-6)


def test_parts_that_are_not_in_play_are_not_shown() -> None:
    cell = Cell(WHOLE)
    services = SceneServices(cell)
    scene = decode_scene(b64decode(services.scene({})["scene"]))
    frame = decode_frame(b64decode(services.frame({})["frame"]))
    hidden = {scene.bodies[index] for index in np.flatnonzero(~frame.shown)}
    out = {cell.simulation.model.body(body).name for body in cell.out_of_sight()}
    assert out
    assert hidden == out & set(scene.bodies)


def test_another_run_has_another_number() -> None:
    cell = Cell(KITTING)
    services = SceneServices(cell)
    before = services.frame({})["run"]
    cell.reset()
    assert services.frame({})["run"] == before + 1


@pytest.mark.parametrize("every", [1, 7])
def test_looking_leaves_no_trace(every: int) -> None:
    watched, alone = Cell(WHOLE), Cell(WHOLE)
    services = SceneServices(watched)
    for tick in range(200):
        watched.step()
        alone.step()
        if tick % every == 0:
            services.frame({})
    assert watched.state_hash() == alone.state_hash()
