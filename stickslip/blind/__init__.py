"""The blind challenge: campaigns with a hidden effect, made by a simulator that shares nothing with the model.

``make`` makes and seals them, ``run`` has them diagnosed, ``score`` compares the answers with the truth.
"""
