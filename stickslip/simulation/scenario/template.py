"""A commented scenario file to start from."""

from __future__ import annotations

_TEMPLATE = """\
# A scenario: a rig, its drive, and what is recorded. Quantities are numbers in SI or text with a unit.
# Run it with:  stickslip simulate scenario.toml --out out/first
schema = 1
title = "My rig"

[block]
mass = "89.4 g"
spring_stiffness = "1000 N/m"      # of the driving spring
damping = "10 N s/m"               # viscous; default 10 N s/m

[drive]
velocity = "50 um/s"               # of the load point
events = 5                         # stop after so many slips; or  duration = "14 s"
start = "rest"                     # or "steady": the block starts with the velocity at which nothing rings
# Holds, velocity steps, reversal instead of 'velocity':
#   piece = [ { velocity = "50 um/s", duration = "6 s" }, { velocity = 0, duration = "10 s" } ]
# A sampled position instead:
#   file = "drive.csv"
#   time = { column = "time", unit = "s" }
#   position = { column = "drive", unit = "um" }

[contact]
kind = "rough-line"                # rough-line, power-law, sphere, cone, flat-punch, heights
contacts = 4
normal_force = "0.31 N"            # of one contact
friction_coefficient = 0.21
H = 0.3                            # Hurst exponent
h_rms = "2.46 um"                  # rms height on a line of the length below
line_length = "20 um"              # L
springs = 4096                     # N; at small H the result depends on it
youngs_modulus = "210 GPa"
poisson_ratio = 0.3
realisation = "each"               # every contact its own line; or "mean": the mean of 'lines' lines
lines = 100
seed = 0
bins = 256                         # Jenkins elements of the dynamic model (other kinds than rough-line: 128)
residual = 0                       # share of the load a slip leaves behind that is there at the start; 0: virgin
# Contacts that differ: one table each, instead of 'contacts'
#   each = [ { normal_force = "0.2 N", h_rms = "2 um" }, { normal_force = "0.4 N" } ]
# Other kinds need other keys:
#   power-law:   u_max = "0.95 um", p = 3.6, spread = 0.1
#   sphere:      radius = "5 mm"
#   cone:        slope = 0.01
#   flat-punch:  half_width = "10 um"
#   heights:     file = "scan.csv", height = { column = "z", unit = "um" }, spacing = "0.1 um"

[weakening]
ratio = 0.85                       # kinetic over static friction
slip_distance = "1 um"             # slip over which strength is lost
healing_time = "20 ms"             # rest over which it returns

# Effects of the catalogue (stickslip effects lists them), with their own parameters:
# [[effect]]
# type = "contact-ageing"
# rate = 0.01

# The vibrometer; without this table the reading is the true displacement.
[sensor]
resolution = "7.91 nm"
# counter_steps = 4096             # the counter wraps after so many counts
# clear_at_arrest = true           # ... and is cleared after every slip
# white = "10 pm/Hz**0.5"
# flicker = "1 nm"                 # 1/f noise, at 1 Hz
# random_walk = "1 nm/s**0.5"
# drift = "2 nm/s"
# low_pass = "20 us"
# high_pass = "0.1 Hz"
# gain = 0.005
# interpolation_error = "2 nm"
# mains = "1 nm"
# speckle_rate = "1000 / m"        # jumps for each metre travelled, of speckle_jump = "30 nm"
# dropout_rate = "100 / m"         # losses of signal, of dropout_time = "1 ms"
# delay = "10 us"
# clock_error = "25 ppm"
seed = 0

[output]
sampling_rate = "10 kHz"
# trace = "trace.csv"              # also .nc, .mat, .uff: written like a measurement, with a campaign.toml
# channels = ["displacement"]      # and velocity, spring_force, drive_position

# Error allowed in a step; tighten all three by ten to see what it changes
# [solver]
# relative = 3e-5                  # of the step's own increment and of its velocity
# displacement = "1 pm"
# velocity = "10 nm/s"

# A series of runs: recurrence and slip against one key
# [sweep]
# key = "drive.velocity"
# start = "20 um/s"
# stop = "1 mm/s"
# points = 8
"""


def scenario_template() -> str:
    """A commented scenario file: the rig of Grzemba 2014."""
    return _TEMPLATE
