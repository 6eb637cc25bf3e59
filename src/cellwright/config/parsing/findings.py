"""Findings about what a file describes, made after it was read: known by key, placed in the file when reported."""

from collections.abc import Mapping
from dataclasses import dataclass

from cellwright.config.parsing.tree import Place, Problem, Severity

_NO_FILE = Place(0, "", 0)


@dataclass(frozen=True, slots=True)
class Finding:
    """Thing that cannot work.

    Attributes:
        key: dotted path to its description in a file.
        message: the fault, its reason, and the remedy.
    """

    key: str
    message: str

    def at(self, places: Mapping[str, Place], severity: Severity) -> Problem:
        """Return the finding with the place of its description, or of the next entry around it that the file has.

        Args:
            places: places of the file's entries, by their dotted paths; without any, the finding has its key alone.
            severity: its weight for the file.

        Example:
            >>> print(Finding("cell.bins.bin1", "is too small").at({"cell": Place(0, "a.yaml", 3)}, "error"))
            a.yaml:3: cell.bins.bin1: is too small
        """
        around = self.key
        while around and around not in places:
            around = around.rpartition(".")[0]
        return Problem(places.get(around, _NO_FILE), self.key, self.message, severity)
