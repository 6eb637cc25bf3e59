"""Which parts are faulty: those whose name, without its origin, is on the trial's list."""

from collections.abc import Iterable

from cellwright.cell.kitting.names import trimmed_name


class Faults:
    """The faulty parts of a trial.

    Args:
        faulty_parts: names as a trial lists them, without origin (`piston_rod_part_3`, `gasket_part_clone_0`).
    """

    def __init__(self, faulty_parts: Iterable[str]) -> None:
        self.names = frozenset(faulty_parts)

    def is_faulty(self, model_name: str) -> bool:
        """Whether the part of this full model name is faulty."""
        return trimmed_name(model_name) in self.names
