"""`python -m cellwright`: the command line, where the command itself is not on the path."""

import sys

from cellwright.cli.main import main

sys.exit(main())
