"""The blind challenge: campaigns with a hidden effect, made by a simulator that shares nothing with the model."""
