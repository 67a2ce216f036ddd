"""Proofs about the dynamic model and its solver."""
