"""Which shapes of a scene are shown."""

from __future__ import annotations

from cellwright.scene import Layer

LOOKS = frozenset({Layer.BOTH, Layer.LOOKS})
"""What is seen."""
TOUCHED = frozenset({Layer.BOTH, Layer.TOUCH})
"""What the engine takes it for."""
