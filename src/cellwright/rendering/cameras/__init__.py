"""Camera sensors: pictures, depth and points, drawn in another process."""
