"""What those who look on ask a server for: services of the server itself, with JSON in and out."""
