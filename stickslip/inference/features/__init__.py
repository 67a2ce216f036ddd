"""Features of a stick-slip cycle, taken by the same lines from a measurement and from the model."""
