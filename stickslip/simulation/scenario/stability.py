"""Whether steady sliding is stable, and from which velocity and spring on: why a rig slides instead of sticking.

Linearised about steady sliding at V with the base law, r = (1 + V/v_c)/t_h and K = dF/(D_c (1 + V/v_c)), the motion
obeys m s^3 + (c + m r) s^2 + (c_s + c r - K) s + c_s r = 0; by Routh and Hurwitz it is stable if and only if
(c + m r)(c_s + c r - K) > m c_s r.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from ...system.units import shown
from .schema import BlockTable, WeakeningTable


@dataclass(frozen=True)
class Sliding:
    """Steady sliding at the drive's velocity.

    Attributes:
        stable: whether a small disturbance dies out.
        critical_velocity: above it sliding is stable (m/s); infinite where it never is, zero where it always is.
        critical_stiffness: above it sliding is stable at this velocity (N/m); infinite or zero likewise.
        reason: one sentence.
    """

    stable: bool
    critical_velocity: float
    critical_stiffness: float
    reason: str


def steady_sliding(block: BlockTable, law: WeakeningTable, strength: float, velocity: float) -> Sliding:
    """Analyse steady sliding.

    Args:
        block, law: the tables of a scenario, ``scenario.file.block`` and ``scenario.file.weakening``.
        strength: full friction of all contacts (N).
        velocity: of the drive (m/s).
    """
    drop = (1.0 - law.ratio) * strength
    speed = abs(velocity)
    limit = _critical_stiffness(block, law, drop, speed)
    stable = block.spring_stiffness > limit
    fastest = _critical_velocity(block, law, drop)
    if drop == 0.0:
        reason = "friction does not weaken (weakening.ratio = 1), so nothing can make the block slip"
    elif speed == 0.0:
        reason = "the drive stands still"
    elif stable:
        reason = _why_stable(block, speed, fastest, limit)
    else:
        top = "at any velocity" if math.isinf(fastest) else f"below {shown(fastest, 'm/s', 3)}"
        stiff = "with any spring" if math.isinf(limit) else f"with a spring softer than {limit:.4g} N/m"
        reason = f"steady sliding is unstable: stick-slip is expected {top}, {stiff}"
    return Sliding(stable, fastest, limit, reason)


def _why_stable(block: BlockTable, speed: float, fastest: float, limit: float) -> str:
    slow = (
        f"with this spring the critical velocity is {shown(fastest, 'm/s', 3)} (the drive has {shown(speed, 'm/s', 3)})"
        if fastest > 0.0
        else "with this spring it is so at every velocity"
    )
    stiff = (
        f"at this velocity the critical stiffness is {limit:.4g} N/m (the spring has {block.spring_stiffness:.4g} N/m)"
        if limit > 0.0
        else "at this velocity no spring is soft enough"
    )
    return f"steady sliding is stable; {slow}, {stiff}"


def _critical_stiffness(block: BlockTable, law: WeakeningTable, drop: float, speed: float) -> float:
    """The stiffness above which sliding at ``speed`` is stable (N/m)."""
    share = 1.0 + speed * law.healing_time / law.slip_distance
    rate, fall = share / law.healing_time, drop / (law.slip_distance * share)
    excess = fall - block.damping * rate
    if excess <= 0.0:
        return 0.0
    if block.damping == 0.0:
        return math.inf
    return (block.damping + block.mass * rate) * excess / block.damping


def _critical_velocity(block: BlockTable, law: WeakeningTable, drop: float) -> float:
    """The velocity above which sliding is stable with this spring (m/s), to 1e-6 of itself."""

    def unstable(speed: float) -> bool:
        return block.spring_stiffness <= _critical_stiffness(block, law, drop, speed)

    slow = [10.0 ** (i / 20) for i in range(-200, 61)]
    below = [v for v in slow if unstable(v)]
    if not below:
        return 0.0
    if below[-1] == slow[-1]:
        return math.inf
    low, high = below[-1], slow[slow.index(below[-1]) + 1]
    while high - low > 1e-6 * low:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if unstable(middle) else (low, middle)
    return low
