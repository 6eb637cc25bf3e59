"""What others bring along: installed packages by entry point, and classes by the file that they stand in."""
