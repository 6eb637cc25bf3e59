from cellwright.cell.kitting.inventory import MaterialLocations

LOCATIONS = MaterialLocations({"gear_part": ("bin7", "belt"), "tray": ("agv1_load_point", "agv2_load_point")})


def test_the_places_of_a_type_are_named_in_alphabetical_order() -> None:
    assert LOCATIONS.locations("gear_part") == ("belt", "bin7")
    assert LOCATIONS.locations("tray") == ("agv1_load_point", "agv2_load_point")


def test_nobody_knows_where_an_unknown_type_is() -> None:
    assert LOCATIONS.locations("flux_capacitor_part") == ()
