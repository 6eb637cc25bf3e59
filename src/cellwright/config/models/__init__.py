"""Part types and furniture of somebody's own, from YAML and from model files."""
