"""Trays that wait with parts while a kit is still open, and the score of each if it were submitted as that kit."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from cellwright.cell.kitting.inventory import TrayContents
from cellwright.cell.kitting.kit_score import BONUS_POINTS, POSE_POINTS, PRESENCE_POINTS, KitScore, score_kit
from cellwright.config.trial.trial import Kit


@dataclass(frozen=True, slots=True)
class UnsentTray:
    """Tray with parts that was not submitted as an open kit.

    Example:
        >>> from cellwright.cell.kitting.inventory import TrayObject
        >>> from cellwright.config.trial.trial import KitObject
        >>> from cellwright.util.pose import Pose
        >>> kit = Kit("order_0_kit_0", (KitObject("gear_part", Pose()), KitObject("disk_part", Pose())))
        >>> there = (TrayObject("bin7|gear_part_1", "gear_part", False, Pose()),)
        >>> print(unsent_trays(kit, {"agv1::kit_tray_1::kit_tray": there})[0].sentence())
        agv1's tray held 1 gear_part; as this kit it would have earned 2 of 6 points (there 1, pose 1, bonus 0)

    Attributes:
        tray: AGV of the tray.
        contents: the parts on it.
        score: score of the kit if this tray were submitted as it.
        is_sent: True if its AGV has been sent with this kit, and submits it when it departs.
    """

    tray: str
    contents: TrayContents
    score: KitScore
    is_sent: bool = False

    def sentence(self) -> str:
        """The parts on the tray, and the points that they would have earned."""
        counts = Counter((each.type, each.is_faulty) for each in self.contents)
        held = ", ".join(f"{count} {'faulty ' * faulty}{kind}" for (kind, faulty), count in counts.items())
        score = self.score
        best = (PRESENCE_POINTS + BONUS_POINTS + POSE_POINTS) * len(score.parts)
        terms = f"there {score.part_presence:g}, pose {score.part_pose:g}, bonus {score.all_parts_bonus:g}"
        earned = f"{score.total:g} of {best:g} points ({terms})"
        subject = f"{self.tray} was on its way with" if self.is_sent else f"{self.tray}'s tray held"
        return f"{subject} {held}; as this kit it would have earned {earned}"

    def as_json(self) -> dict[str, Any]:
        """Return the tray as JSON values."""
        return {
            "tray": self.tray,
            "on_its_way": self.is_sent,
            "parts": [{"name": each.name, "type": each.type, "faulty": each.is_faulty} for each in self.contents],
            "would_earn": self.score.total,
            "part_presence": self.score.part_presence,
            "all_parts_bonus": self.score.all_parts_bonus,
            "part_pose": self.score.part_pose,
            "sentence": self.sentence(),
        }


def unsent_trays(
    kit: Kit, trays: Mapping[str, TrayContents], sent: Mapping[str, str] = MappingProxyType({})
) -> tuple[UnsentTray, ...]:
    """Judge each tray that holds parts as the kit: those on their way with it first, then the best.

    Args:
        kit: the kit that was not submitted.
        trays: contents of the trays that wait at their stations, by the tray's link.
        sent: kit types that AGVs have been sent with and not submitted yet, by the tray's link.
    """
    found = [
        UnsentTray(link.partition("::")[0], contents, score_kit(kit, contents), sent.get(link) == kit.kit_type)
        for link, contents in trays.items()
        if contents
    ]
    return tuple(sorted(found, key=lambda each: (not each.is_sent, -each.score.total, each.tray)))
