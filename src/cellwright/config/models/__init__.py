"""User-defined part types and furniture, from YAML and from model files."""
