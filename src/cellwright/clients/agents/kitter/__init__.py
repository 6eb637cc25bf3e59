"""The bundled agent: it builds every ordered kit from bins and belt, with what its sensors tell it and nothing else.

Skills (`eyes`, `belt_watch`, `arm`, `picking`, `placing`) know how, the strategy (`strategy`) knows what and when.
"""
