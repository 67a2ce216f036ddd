"""The catalogue of effects: one module and one class each."""
