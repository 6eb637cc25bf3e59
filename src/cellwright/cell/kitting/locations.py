"""Where material of a type is to be found, as the competition answers it."""

from collections.abc import Mapping


class MaterialLocations:
    """Storage units by type of material.

    Args:
        by_type: for each type the bins, the belt or the load points where it is, as in `Trial.material_locations`.
    """

    def __init__(self, by_type: Mapping[str, tuple[str, ...]]) -> None:
        self._by_type = {type_: tuple(sorted(units)) for type_, units in by_type.items()}

    def locations(self, material_type: str) -> tuple[str, ...]:
        """The storage units of a type, by name; none for a type that nobody knows."""
        return self._by_type.get(material_type, ())
