"""Scene of a cell or robot, independent of the engine's model: shapes on bodies, and poses of the bodies.

Viewers, videos, cameras and recordings share it: small, and the same for every version of the engine.
"""

from cellwright.rendering.scene.scene import SEEN, TOUCHED, Mesh, Scene, SceneFrame, SceneShape, ShapeLayer, ShapeType

__all__ = ["SEEN", "TOUCHED", "Mesh", "Scene", "SceneFrame", "SceneShape", "ShapeLayer", "ShapeType"]
