"""What a robot program holds in its hand."""
