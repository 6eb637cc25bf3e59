"""Command group `cellwright env`: environments for learning."""
