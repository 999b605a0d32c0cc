"""`python -m moldline`."""

import sys

from .cli import main

sys.exit(main())
