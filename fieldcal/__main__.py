"""`python -m fieldcal` is the command line."""

import sys

from fieldcal.cli import main

sys.exit(main())
