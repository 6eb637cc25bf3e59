"""Browser operator: drives a robot from its page, over the same topics as every client."""
