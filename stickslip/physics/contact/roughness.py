"""Self-affine rough lines: fixed amplitudes, random phases.

The line is the one-dimensional equivalent of an isotropic surface in the method of dimensionality reduction (Geike
and Popov 2007), with spectral density C_1D(q) = pi q C_2D(q) ~ q^(-2H-1); it has the surface's H and rms height. It
is not a cut through the surface, see `cut_to_line_factor`. Lines as a user makes them are `.rough_lines.RoughLines`.
"""

from __future__ import annotations

from functools import lru_cache

import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.scipy.special import gammaln
from jax.typing import ArrayLike

from ...errors import InputError
from ...system import jax_settings  # noqa: F401  (before the first array)
from ._ranges import check_within


def lines_from_phasors(
    H: ArrayLike, phasors: ArrayLike, *, roll_off: ArrayLike | None = None, cut_off: ArrayLike | None = None
) -> Array:
    """Lines of zero mean and unit rms height from phase factors (n_lines, n_springs/2); waves as shares of a line."""
    phasors = jnp.asarray(phasors)
    half = phasors.shape[-1]
    amplitude = amplitudes(H, half, roll_off=roll_off, cut_off=cut_off)
    spectrum = jnp.pad(amplitude * phasors, [(0, 0)] * (phasors.ndim - 1) + [(1, 0)])
    # Parseval: each wave counts twice (+q and -q) but the shortest, of which only the real part exists
    power = 2.0 * jnp.sum(amplitude[:-1] ** 2) + (amplitude[-1] * phasors[..., -1:].real) ** 2
    return jnp.fft.irfft(spectrum, axis=-1) * (2 * half / jnp.sqrt(power))


def amplitudes(
    H: ArrayLike, half: int, *, roll_off: ArrayLike | None = None, cut_off: ArrayLike | None = None
) -> Array:
    """(half,) amplitudes k^-(H + 1/2) of the waves with k = 1 ... half periods on the line (not normalised)."""
    k = jnp.arange(1, half + 1, dtype=float)
    amplitude = (k if roll_off is None else jnp.maximum(k, 1.0 / roll_off)) ** -(H + 0.5)
    if cut_off is None:
        return amplitude
    # the last wave fades in over one unit of k, so that the line is continuous in the cut-off
    return amplitude * jnp.clip(1.0 / cut_off + 1.0 - k, 0.0, 1.0)


@lru_cache(maxsize=8)
def line_phasors(n_lines: int, n_springs: int, seed: int) -> np.ndarray:
    """(n_lines, n_springs/2) factors exp(i phi), phi uniform on the circle; one generator for each line."""
    phases = np.stack([np.random.default_rng([seed, line]).random(n_springs // 2) for line in range(n_lines)])
    phasors = np.exp(2j * np.pi * phases)
    phasors.flags.writeable = False
    return phasors


def cut_to_line_factor(H: ArrayLike) -> Array:
    """By which factor the heights of a measured cut must be multiplied to serve as an equivalent line.

    A cut through an isotropic self-affine surface has the density C_1D * Gamma(H + 1/2) / (sqrt(pi) Gamma(H + 1)).
    """
    check_within("the Hurst exponent", H, above=0.0, below=1.0, key="H")
    return jnp.exp(0.5 * (0.5 * jnp.log(jnp.pi) + gammaln(H + 1.0) - gammaln(H + 0.5)))


def check_line(lines: int, n_springs: int) -> None:
    """Raise InputError unless the number of lines and the number of springs are usable."""
    if not isinstance(lines, int) or lines < 1:
        raise InputError("no number of rough lines", key="lines", value=lines, allowed="1, 2, 3, ...")
    if not isinstance(n_springs, int) or n_springs < 4 or n_springs % 2:
        raise InputError(
            "cannot make a line of that many springs", key="n_springs", value=n_springs, allowed="even, 4 or more"
        )
