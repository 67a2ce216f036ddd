"""``python -m stickslip``: the same as the command ``stickslip``."""

import sys

from .cli import main

sys.exit(main())
