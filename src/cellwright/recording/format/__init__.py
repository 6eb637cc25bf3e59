"""Recording files and run logs, readable even after the program was killed."""
