"""What sees: one file a sensor type."""
