"""Double precision, set before anything makes an array; every module that uses JAX imports this first."""

import jax

jax.config.update("jax_enable_x64", True)
