"""Exact force of a bank with constant caps under any motion: the turning points and the backbone say it all.

Masing's rules: from a turning point on, the force follows the backbone doubled in both directions; a branch that
returns to an earlier turning point goes on as if the loop had never been (return-point memory, wiping-out).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jax.typing import ArrayLike


class Hysteresis:
    """Force of a contact against its displacement, one turning point at a time; the reference for the bank.

    Args:
        backbone: force (N) on first loading to a displacement ``u >= 0`` (m), as `Bank.backbone`.

    Valid while the caps are constant. It starts free of force at zero displacement.
    """

    def __init__(self, backbone: Callable[[float], ArrayLike]) -> None:
        self._backbone = backbone
        self._turns: list[tuple[float, float]] = []
        self._direction = 0
        self.u = 0.0
        self.force = 0.0

    @property
    def turning_points(self) -> tuple[tuple[float, float], ...]:
        """Displacement (m) and force (N) of the turning points that still matter, oldest first."""
        return tuple(self._turns)

    def move_to(self, u: float) -> float:
        """Go to displacement ``u`` (m) without turning back on the way; returns the force in N."""
        if u == self.u:
            return self.force
        direction = 1 if u > self.u else -1
        if self._direction == -direction:
            self._turns.append((self.u, self.force))
        self._direction = direction
        while self._turns and direction * u >= direction * self._end_of_branch():
            # the loop is closed: it and the branch that it interrupted are one again
            del self._turns[-2:]
        if self._turns:
            start, force = self._turns[-1]
            self.force = force + direction * 2.0 * self._virgin(abs(u - start) / 2.0)
        else:
            self.force = float(np.sign(u)) * self._virgin(abs(u))
        self.u = u
        return self.force

    def _end_of_branch(self) -> float:
        """Where the present branch meets an older one: the turning point before, or the mirror image of the first."""
        return self._turns[-2][0] if len(self._turns) > 1 else -self._turns[0][0]

    def _virgin(self, u: float) -> float:
        return float(np.asarray(self._backbone(u)))
