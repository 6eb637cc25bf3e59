"""The part types of the trial's own, as programs may ask for them: what each offers to the cup, as JSON."""

from __future__ import annotations

import json
from dataclasses import asdict

from cellwright.cell.model.own_models import own_part_types
from cellwright.cell.model.part_tops import part_tops
from cellwright.config.trial.trial import Trial


def part_types(trial: Trial) -> str:
    """The part types of a trial's own, by name, as a JSON object; lengths in m, mass in kg.

    Each has its `mass`, and `tops` with the fields of `world.part_tops.PartTop`, the first as it was modelled. Where
    parts are, this does not tell.
    """
    found = {
        name: {"mass": own.form.mass, "tops": [asdict(top) for top in part_tops(own.form)]}
        for name, own in own_part_types(trial).items()
    }
    return json.dumps(found, sort_keys=True)
