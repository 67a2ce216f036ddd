"""What bounds the steps of an integration."""

PIECE = 16384  # steps between two looks at the clock; bounds the memory of one compiled call
SMALLEST_STEP = 1e-10  # s; four orders below the period of any contact resonance a vibrometer could see
