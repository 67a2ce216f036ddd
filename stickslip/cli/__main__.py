"""``python -m stickslip.cli``."""

from . import main

main()
