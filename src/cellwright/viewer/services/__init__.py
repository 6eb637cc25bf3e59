"""Services of the server for viewers, with JSON in and out."""
