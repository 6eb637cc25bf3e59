"""What may be known of a cell: a competition that is not over tells neither what comes up nor what is faulty."""

from __future__ import annotations

from dataclasses import replace

from cellwright.cell.cell import Cell
from cellwright.cell.kitting.score.evidence import Evidence, evidence
from cellwright.config.trial.trial import Order, Trial


def keeps_secrets(cell: Cell) -> bool:
    """Whether this is a competition that is not over yet."""
    return cell.in_competition and cell.competition.referee.end_reason is None


def known_orders(cell: Cell) -> list[Order]:
    """All orders that may be known, those announced first; while secrets are kept, no others."""
    announced = cell.competition.announced
    if keeps_secrets(cell):
        return announced
    return [*announced, *(order for order in cell.trial.orders if order not in announced)]


def without_faults(cell: Cell) -> Trial:
    """The trial; while secrets are kept, as if all parts were good, for what is out of reach tells how many are not."""
    return replace(cell.trial, faulty_parts=frozenset()) if keeps_secrets(cell) else cell.trial


def known_evidence(cell: Cell) -> Evidence:
    """The score with its evidence; while secrets are kept, as if there were no orders but those that have come up."""
    if not keeps_secrets(cell):
        return cell.competition.evidence()
    trial = replace(without_faults(cell), orders=tuple(known_orders(cell)))
    return evidence(trial, cell.competition.score(), cell.competition.process_time)
