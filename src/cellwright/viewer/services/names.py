"""Names of the services for those who look on. Pages and other guests know them by these, and load nothing else."""

SCENE = "cellwright/scene"
"""What there is to be seen."""
FRAME = "cellwright/frame"
"""Where it is now."""
PANEL = "cellwright/panel"
"""What a panel shows of it, and how its time passes."""
CONTROL = "cellwright/control"
"""How its time is to pass."""

FOR_ONLOOKERS = (SCENE, FRAME, PANEL, CONTROL)
"""All of them."""
