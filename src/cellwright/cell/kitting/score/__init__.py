"""The score: what each part, kit and trial earned, and the evidence for it."""
