"""The force along the measured motion: what the contact must have held, and what a friction law driven by it holds."""
