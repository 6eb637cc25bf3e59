"""The bundled agent: builds every ordered kit from bins and belt, using its sensors alone.

Skills (`cell_view`, `kits`, `arm`, `pick_and_place`) act; the strategy (`agent`) decides.
"""
