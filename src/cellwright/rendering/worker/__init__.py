"""Render process: drawing neither delays the process of a cell, nor crashes it by a driver's fault."""

from cellwright.rendering.worker.client import RenderWorker
from cellwright.util.errors import RenderingError

__all__ = ["RenderWorker", "RenderingError"]
