"""What stands where: turns a description into an engine model. Knows no time."""
