"""For eyes: pictures and reports."""
