"""The channels of a run and their units."""

SIGNALS = {"displacement": "m", "velocity": "m/s", "spring_force": "N"}
CHANNELS = {**SIGNALS, "drive_position": "m", "normal_load": "N"}
