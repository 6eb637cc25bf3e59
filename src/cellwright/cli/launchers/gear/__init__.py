"""The launcher of 2017, `gear.py`: its command line, its files and its log, in front of `cellwright serve --ros1`."""
