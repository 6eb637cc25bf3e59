"""What has come of a served run by now, for a guest that asks."""

from __future__ import annotations

import io
from dataclasses import replace
from typing import Any

from rich.console import Console

from cellwright.cli.run import document, score_table
from cellwright.running.serving import Serving
from cellwright.viewer.services.known import keeps_secrets, known_evidence

RESULT = "/cellwright/result"
"""A service of the server itself, not of the cell: JSON with the result as a document, and as text for people."""

_WIDTH = 80


def offer_result(serving: Serving) -> None:
    """Offer the result to guests. Of a competition that is not over they are told what they may know, and no more."""
    cell = serving.cell

    def answer(_request: dict[str, Any]) -> dict[str, Any]:
        result = replace(serving.result_by_now(), evidence=known_evidence(cell))
        text = io.StringIO()
        score_table.show(Console(file=text, width=_WIDTH, highlight=False), result)
        told = document.of_run(cell, "served", result, 0, [])
        if keeps_secrets(cell):
            told |= {"seed": None, "circumstances": None}  # with them one could reckon with noise and friction
        return {"document": told, "text": text.getvalue()}

    serving.server.offer(RESULT, answer)
