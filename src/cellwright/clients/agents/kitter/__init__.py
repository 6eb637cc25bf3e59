"""The bundled agent: it builds every ordered kit from bins and belt, with what its sensors tell it and nothing else.

Skills (`cell_view`, `kits`, `arm`, `pick_and_place`) know how, the strategy (`agent`) knows what and when.
"""
