"""Results of an evaluation: their files, their figures, and what they say."""
