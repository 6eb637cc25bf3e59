"""A process that draws, so that neither time nor a driver's faults are lost to the process in which a cell runs."""

from cellwright.rendering.worker.client import RenderWorker
from cellwright.util.errors import RenderingError

__all__ = ["RenderWorker", "RenderingError"]
