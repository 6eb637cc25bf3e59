"""Message and service types, from their definitions."""
