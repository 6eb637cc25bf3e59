"""Robot descriptions: URDF files, robot configuration files, and the bundled robots."""
