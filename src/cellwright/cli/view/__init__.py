"""`cellwright view`, and the page that `--view` opens."""
