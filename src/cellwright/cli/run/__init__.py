"""`cellwright run`, and what a run looks like to people and programs."""
