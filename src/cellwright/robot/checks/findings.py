"""What a check of a robot's motion found."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that was looked at.

    Attributes:
        what: it is, for people.
        worst: the figure that came out worst.
        limit: what it may be.
        unit: of both.
        where: the worst figure was found; empty where there is but one.
        passed: whether all was well.
        note: more to say, in a sentence.
        remedy: what to do where it failed, in a sentence.
    """

    what: str
    worst: float
    limit: float
    unit: str
    where: str = ""
    passed: bool = True
    note: str = ""
    remedy: str = ""


@dataclass(frozen=True)
class MotionReport:
    """What a check of a robot's motion found.

    Attributes:
        robot: its name.
        reference: where the motion that it was compared with is from; empty where it was not compared with any.
        findings: all of them.
    """

    robot: str
    reference: str
    findings: tuple[Finding, ...]

    @property
    def passed(self) -> bool:
        """Whether all findings passed."""
        return all(finding.passed for finding in self.findings)
