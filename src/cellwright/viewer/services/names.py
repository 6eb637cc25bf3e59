"""Names of the viewer services. Pages and other clients import these only."""

SCENE = "cellwright/scene"
"""Shapes, bodies and meshes."""
FRAME = "cellwright/frame"
"""Poses of the bodies."""
PANEL = "cellwright/panel"
"""Panel, with the state of time."""
CONTROL = "cellwright/control"
"""Time control."""

VIEWER_SERVICES = (SCENE, FRAME, PANEL, CONTROL)
"""All services for viewers."""

MIN_DEVIATION = 0.02
"""A tool farther from its setpoint than this [m] is held up."""

PAGE = "/page_"
"""Prefix of the node names of pages."""


def is_viewer(node: str) -> bool:
    """Return whether a client of this name is a viewer, and no agent."""
    return node.startswith(PAGE)
