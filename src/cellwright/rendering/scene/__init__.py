"""What is seen of a cell or a robot, apart from the engine's model: shapes on bodies, and where the bodies are.

It is what viewers, videos, cameras and recordings have in common: small, and the same for every version of the engine.
"""

from cellwright.rendering.scene.scene import SEEN, TOUCHED, Form, Frame, Layer, Mesh, Scene, Shape

__all__ = ["SEEN", "TOUCHED", "Form", "Frame", "Layer", "Mesh", "Scene", "Shape"]
