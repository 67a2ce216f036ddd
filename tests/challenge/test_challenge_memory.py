"""What a process of a long run gives back between two pieces of its work."""

from __future__ import annotations

import jax
import jax.numpy as jnp

from stickslip.system.process import forget_programs


def test_compiled_programs_go_where_a_process_holds_much_and_only_there():
    double = jax.jit(lambda x: 2.0 * x)
    for n in (3, 4, 5):  # campaigns of other sizes
        double(jnp.ones(n))
    assert double._cache_size() == 3
    assert not forget_programs(2**60)
    assert double._cache_size() == 3
    assert forget_programs(0)
    assert double._cache_size() == 0
    assert float(double(jnp.ones(3))[0]) == 2.0
