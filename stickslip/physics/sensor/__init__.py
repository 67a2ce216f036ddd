"""A laser vibrometer: what it shows of a motion, with its counts, filters, noise and faults."""

from .chain import Vibrometer, measure
from .noise import flicker_noise, random_walk, white_noise

__all__ = ["Vibrometer", "flicker_noise", "measure", "random_walk", "white_noise"]
