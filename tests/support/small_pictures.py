"""Command `cellwright` with small pictures, an eighth as wide and high: a fraction of a second instead of ten.

Tests of pages run it as a program, `python -P tests/support/small_pictures.py …`, in place of the command; or its
text, in a process that has loaded Cellwright.
"""

import sys
from typing import Any

from cellwright.util.process import silent_ctrl_c

with silent_ctrl_c():  # as the command itself does while it loads
    from cellwright.rendering import picture

draw_full_size = picture.render


def render(model: Any, data: Any, camera: Any, size: tuple[int, int] = (1280, 720), **options: Any) -> Any:
    """Draw a picture as `picture.render` does, smaller and with one ray for each pixel."""
    width, height = size
    return draw_full_size(model, data, camera, (width // 8, height // 8), **{**options, "samples": 1})


if __name__ == "__main__":
    with silent_ctrl_c():
        from cellwright.running.run.observers import Pictures
    Pictures._draw = Pictures._draw_by_rays  # type: ignore[method-assign]
    for module in [*sys.modules.values()]:  # all loaded modules, and through `picture` those loaded later
        if getattr(module, "render", None) is draw_full_size:
            vars(module)["render"] = render
    from cellwright.__main__ import main

    sys.argv[0] = "cellwright"
    sys.exit(main())
