"""Open benchmark of kit building: eight tasks with their seeds, demonstrations, baselines, scores and submissions."""
