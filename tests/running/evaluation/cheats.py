"""A trial on which an honest program has 4 of 6 points, and programs that cheat for the other two."""

from tests.running.evaluation.programs import TRIAL

SPOILED = TRIAL.replace("orders:", "      three: {type: piston_rod_part, pose: {xyz: [0.0, -0.15, 0.01]}}\norders:")
"""The trial with a part on the tray that nothing ordered, so that the bonus is lost."""

CHEATS = '''
import json
from pathlib import Path

from programs import Deliver as Honest


class Deliver(Honest):
    pass


class PatchesScorer(Honest):
    """Replaces the scorer of its own process."""

    def run(self, client):
        from cellwright.cell.kitting.kit_score import KitScore

        KitScore.total = property(lambda score: 6.0)
        super().run(client)


class Teleports(Honest):
    """Takes the spoiling part off the tray, by hand."""

    def run(self, client):
        client.start_competition()
        client.sleep(0.1)
        cell = client.transport.cell
        (part,) = [each for each in cell.parts.by_body.values() if "agv1" in each.name and "piston" in each.name]
        cell.parts.put_away(part)
        client.sleep(1.0)
        client.control_agv(1, "order_0_kit_0")


class EditsResults(Honest):
    """Gives all points to results that are on the disk, sealed as Cellwright does it."""

    def run(self, client):
        from dataclasses import replace

        from cellwright.running.evaluation.results.results_file import read_results

        super().run(client)
        edited = [replace(each, points=6.0) for each in read_results(Path("out")).values()]
        Path("out/results.jsonl").write_bytes(b"".join(each.line + b"\\\\n" for each in edited))
'''
