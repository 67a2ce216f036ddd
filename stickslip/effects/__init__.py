"""The catalogue of effects: one module and one class each; importing this package registers them all."""

from . import (
    base_vibration,
    drive_ripple,
    inertia,
    load_modulation,
    machine_compliance,
    nonlinear_spring,
    sensor_drift,
    sensor_gain,
    sensor_high_pass,
    sensor_low_pass,
    tilt,
)
