"""Command `cellwright teleop`: a robot controller node, and checks of a robot's motion and of a driver."""
