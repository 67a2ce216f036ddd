"""stickslip: creep and stick-slip of a rough contact."""

__version__ = "0.1.0"
