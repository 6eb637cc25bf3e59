"""The arm's controller: goals, interpolation and tolerances."""
