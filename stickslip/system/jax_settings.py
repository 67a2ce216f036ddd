"""Settings of JAX that must stand before the first array; every module that uses JAX imports this first.

Double precision, and loops compiled as one piece. XLA runs a loop on the CPU as a list of small kernels, which costs
about 20 us a step of ours; loops whose buffers stay below a threshold (1 kB unless told otherwise) it compiles to a
single function instead. Measured with jaxlib 0.10.2: five slip events take 0.04 s instead of 0.10 s (0.19 s of
processor time), the features of a whole campaign 0.06 s instead of 0.26 s (0.51 s).
"""

import os

import jax

_WHOLE_LOOPS = "--xla_backend_extra_options=xla_cpu_small_while_loop_byte_threshold=16777216"

if "xla_backend_extra_options" not in os.environ.get("XLA_FLAGS", ""):
    # read when the first array is made; child processes inherit it
    os.environ["XLA_FLAGS"] = f"{os.environ.get('XLA_FLAGS', '')} {_WHOLE_LOOPS}".strip()

jax.config.update("jax_enable_x64", True)
