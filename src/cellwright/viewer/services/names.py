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

MIN_DEVIATION = 0.02
"""A tool farther from its setpoint than this [m] is held up."""

PAGE = "/page_"
"""What the names of pages as guests begin with."""


def is_viewer(node: str) -> bool:
    """Whether a guest of this name looks on, and does not work what is served."""
    return node.startswith(PAGE)
