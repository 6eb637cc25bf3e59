"""`cellwright eval`: evaluations, their merge, their comparison and their page."""
