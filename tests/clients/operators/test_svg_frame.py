from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np

from cellwright.clients.operators.plots import LEFT, RIGHT, WIDTH, frame, page

SVG = "{http://www.w3.org/2000/svg}"


def test_a_curve_fills_its_frame() -> None:
    times, values = np.array([0.0, 5.0, 10.0]), np.array([1.0, 3.0, 2.0])
    root = ET.fromstring(page([frame([(times, values, "red")], 10.0, 20, 110, label="m", below="time [h]")], 160))
    line = root.find(f"{SVG}polyline")
    assert line is not None
    points = [tuple(map(float, pair.split(","))) for pair in line.attrib["points"].split()]
    assert points == [(LEFT, 125.0), ((LEFT + WIDTH - RIGHT) / 2, 25.0), (WIDTH - RIGHT, 75.0)]
    texts = [each.text for each in root.findall(f"{SVG}text")]
    assert {"m", "time [h]", "2", "10"} <= set(texts)
    assert root.attrib["height"] == "160"


def test_what_never_changes_can_be_drawn() -> None:
    ET.fromstring(page([frame([(np.arange(3.0), np.ones(3), "red")], 2.0, 0, 100)], 100))
