"""What has come of a served run by now, for a guest that asks."""

from __future__ import annotations

import io
from typing import Any

from rich.console import Console

from cellwright.cli.run import document, score_table
from cellwright.serving import Serving

RESULT = "/cellwright/result"
"""A service of the server itself, not of the cell: JSON with the result as a document, and as text for people."""

_WIDTH = 80


def offer_result(serving: Serving) -> None:
    """Offer the result to guests."""

    def answer(_request: dict[str, Any]) -> dict[str, Any]:
        result = serving.result_by_now()
        text = io.StringIO()
        score_table.show(Console(file=text, width=_WIDTH, highlight=False), result)
        return {"document": document.of_run(serving.cell, "served", result, 0, []), "text": text.getvalue()}

    serving.server.offer(RESULT, answer)
