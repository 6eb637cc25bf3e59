"""What was recorded, once more: played to programs, and run again from its commands to see if it comes out alike."""
