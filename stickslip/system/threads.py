"""Linear algebra in one thread, set through environment variables before numpy is imported.

The matrices of a fit are a thousand by a hundred. On two processors their singular values took 24 to 97 ms with the
two threads that OpenBLAS takes, and 6 to 7 ms with one: threads that wait for each other, and for other work on the
machine, cost more than they share. It also makes last digits independent of how many processors there are.
"""

from __future__ import annotations

import os

LIBRARIES = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


def one_for_linear_algebra() -> None:
    """Have this process, and those it starts, do linear algebra in one thread, unless the user has said otherwise."""
    for name in LIBRARIES:
        os.environ.setdefault(name, "1")
