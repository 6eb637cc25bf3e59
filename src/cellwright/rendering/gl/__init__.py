"""Pictures by OpenGL, without a display: on a GPU, or in software where there is none.

What falls on a surface and comes back is computed as in `rendering.shading`, by the same figures; soft shadows and the
sky are looked up in maps instead of asked of rays. So a picture takes a fraction of a second, and looks much the same.
Loaded by processes that draw, and by no other: drivers are not for the process in which a cell runs.
"""
