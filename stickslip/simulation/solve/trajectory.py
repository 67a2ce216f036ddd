"""What an integration leaves behind: the accepted steps, and any time in between by the solver's own interpolant."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ...system.object_repr import Shown, facts
from ...system.units import ends, shown

if TYPE_CHECKING:
    import xarray


class Steps(NamedTuple):
    """Accepted steps, the start included; every field has shape (n,).

    Attributes:
        t: time (s).
        x, v: displacement (m) and velocity (m/s) of the block.
        reading: displacement that the sensor shows (m).
        spring_force, contact_force: pull of the driving spring, force of all contacts that holds the block back (N).
        psi: weakening state, 1 rested ... 0 fully weakened.
        sliding: share of the contact's strength that slides (1).
        spring_work, friction_work, viscous_work, body_work: energy since the start (J) done by the spring, lost in
            friction, lost in viscous damping, given by effects.
        stored: energy in motion and in the elements (J).
    """

    t: Any
    x: Any
    v: Any
    reading: Any
    spring_force: Any
    contact_force: Any
    psi: Any
    sliding: Any
    spring_work: Any
    friction_work: Any
    viscous_work: Any
    body_work: Any
    stored: Any


UNITS = {  # of the energies J
    "t": "s", "x": "m", "v": "m/s", "reading": "m", "spring_force": "N", "contact_force": "N", "psi": "1",
    "sliding": "1",
}  # fmt: skip


def hermite(s: Any, h: Any, dx: Any, v0: Any, v1: Any) -> Any:
    """Displacement since the start of a step at its fraction ``s``, from increment and end velocities (cubic)."""
    return s * s * (3 - 2 * s) * dx + h * s * (1 - s) * ((1 - s) * v0 - s * v1)


@dataclass(frozen=True)
class Stats:
    """What the integration cost and how well it kept its books.

    Attributes:
        steps, rejected: accepted and rejected steps.
        energy_error: largest imbalance of the energies over the work done by the spring (1).
        seconds: wall time.
        ended: how: ``"complete"`` at the end that was asked for, ``"until"`` where that condition held, ``"failed"``.
    """

    steps: int
    rejected: int
    energy_error: float
    seconds: float
    ended: str = "complete"


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory(Shown):
    """An integration from start to end.

    Attributes:
        steps: the accepted steps.
        stats: cost and energy balance.
    """

    steps: Steps
    stats: Stats

    def to_xarray(self, t: ArrayLike | None = None) -> xarray.Dataset:
        """Everything over the time ``t`` (s), shape (m,), default that of the steps; SI units in ``attrs["units"]``."""
        import xarray

        found = (self.steps if t is None else self.at(t))._asdict()
        data = {name: ("time", values, {"units": UNITS.get(name, "J")}) for name, values in found.items()}
        return xarray.Dataset(data, coords={"time": data.pop("t")}, attrs=asdict(self.stats))

    def _parts(self) -> list[str]:
        s, stats = self.steps, self.stats
        cost = {
            "from": shown(float(s.t[0]), "s"), "to": shown(float(s.t[-1]), "s"), "steps": stats.steps,
            "rejected": stats.rejected, "energy error": f"{stats.energy_error:.1e}",
            "wall time": shown(stats.seconds, "s", 3), "ended": stats.ended,
        }  # fmt: skip
        told = ("x", "v", "spring_force", "contact_force")
        return [facts(cost), facts({name: ends(getattr(s, name), UNITS[name]) for name in told})]

    def at(self, t: ArrayLike) -> Steps:
        """Everything at the times ``t`` (s), shape (m,): cubic in the displacement, its derivative in the velocity
        (between the ends of long steps a straight line would have edges), linear in the rest. Before its start and
        after its end a trajectory is what it is there."""
        s = self.steps
        t = np.clip(np.asarray(t, float), s.t[0], s.t[-1])
        i = np.clip(np.searchsorted(s.t, t, side="right") - 1, 0, max(s.t.size - 2, 0))
        h = s.t[i + 1] - s.t[i]
        w = (t - s.t[i]) / h
        linear = Steps(*(f[i] + w * (f[i + 1] - f[i]) for f in s))
        bend = s.x[i] + hermite(w, h, s.x[i + 1] - s.x[i], s.v[i], s.v[i + 1]) - linear.x
        mean = (s.x[i + 1] - s.x[i]) / h
        v = 6.0 * w * (1.0 - w) * mean + (1.0 - w) * (1.0 - 3.0 * w) * s.v[i] + w * (3.0 * w - 2.0) * s.v[i + 1]
        return linear._replace(t=t, x=linear.x + bend, v=v, reading=linear.reading + bend)


def energy_error(s: Steps) -> float:
    """Largest |spring + effects - stored - friction - viscous| over the largest work done by the spring."""
    gap = (s.spring_work + s.body_work) - (s.stored - s.stored[0]) - s.friction_work - s.viscous_work
    scale = np.max(np.abs(s.spring_work)) + np.max(np.abs(s.stored))
    return float(np.max(np.abs(gap)) / scale) if scale > 0 else 0.0
