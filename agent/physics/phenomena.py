"""Which friction law shows which phenomenon: thesis Table 3.2, every cross from a simulation.

Each experiment asks a law the question that a test bench would ask, and knows nothing of how the
law is written. Laws without memory are asked through their torque at rest and in motion.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from agent.physics.friction import STRIBECK
from agent.physics.friction_dynamic import BlimanSorine, Dahl, LuGre
from agent.physics.friction_static import StaticFriction

Floats = NDArray[np.float64]
Torque = Callable[[Floats, Floats], Floats]
"""``torque(time, velocity)``, all of shape (n,), from rest; N m."""

_STICTION = {"static_extra_nm": 0.3, "stribeck_velocity_rad_s": 0.1, "exponent": 2.0}
_SLIDING = {"coulomb_nm": 1.0, "viscous_nm_s_per_rad": 0.4}


def _memoryless(coulomb_nm: float, viscous: float, static_extra_nm: float) -> Torque:
    law = StaticFriction(coulomb_nm, viscous, static_extra_nm)

    def torque(time_s: Floats, velocity_rad_s: Floats) -> Floats:
        del time_s
        # A joint at rest that is about to move is pushed as hard as friction can hold.
        return law.torque_nm(velocity_rad_s, np.full_like(velocity_rad_s, np.inf))

    return torque


def _stribeck(time_s: Floats, velocity_rad_s: Floats) -> Floats:
    rest = _memoryless(1.0, 0.0, 0.3)(time_s, velocity_rad_s)
    return np.where(
        velocity_rad_s == 0.0, rest, STRIBECK.torque(velocity_rad_s, {**_SLIDING, **_STICTION})
    )


LAWS: Mapping[str, Torque] = MappingProxyType(
    {
        "Coulomb": _memoryless(1.0, 0.0, 0.0),
        "Coulomb, viscous": _memoryless(1.0, 0.4, 0.0),
        "Coulomb, viscous, static": _memoryless(1.0, 0.4, 0.3),
        "Coulomb, viscous, static, Stribeck": _stribeck,
        "Dahl": Dahl(1.0, 1000.0).torque_nm,
        "Bliman-Sorine": BlimanSorine(2.0, 1.0, 0.2, 0.005, 0.4).torque_nm,
        "LuGre": LuGre(1.0, 0.4, 0.3, 0.1, 1000.0, 1.0).torque_nm,
    }
)
"""The columns of the table, with typical numbers."""

_DULL = 0.02  # N m against a Coulomb level of 1: what no test bench would call a phenomenon


def _settled(law: Torque, speed_rad_s: float) -> float:
    """Return the torque of a lasting velocity after a travel of 1 rad."""
    time = np.linspace(0.0, 1.0 / abs(speed_rad_s), 4001)
    return float(law(time, np.full(time.shape, speed_rad_s))[-1])


def _without_viscous(law: Torque, torque_nm: Floats, velocity_rad_s: Floats | float) -> Floats:
    """Return torque less the slope that fast sliding shows, shape (n,)."""
    slope = _settled(law, 2.0) - _settled(law, 1.0)
    return np.asarray(torque_nm - slope * velocity_rad_s)


def _breakaway(law: Torque, acceleration_rad_s2: float) -> float:
    """Return the highest torque, less viscous, in the first 20 mrad of a drive off from rest."""
    time = np.linspace(0.0, float(np.sqrt(0.04 / acceleration_rad_s2)), 20001)
    velocity = acceleration_rad_s2 * time
    return float(np.max(_without_viscous(law, law(time, velocity), velocity)))


def shows_coulomb(law: Torque) -> bool:
    """Tell whether a crawl in either direction meets a torque that does not vanish with speed."""
    return _settled(law, 1e-3) > 0.5 and _settled(law, -1e-3) < -0.5


def shows_viscous(law: Torque) -> bool:
    """Tell whether fast sliding, beyond every boundary effect, costs more the faster it is."""
    return _settled(law, 2.0) - _settled(law, 1.0) > _DULL


def shows_static(law: Torque) -> bool:
    """Tell whether leaving rest costs more than sliding on, viscous friction aside."""
    sliding = _without_viscous(law, np.array(_settled(law, 0.2)), 0.2)
    return _breakaway(law, 1e-3) - float(sliding) > _DULL


def shows_stribeck(law: Torque) -> bool:
    """Tell whether lasting friction falls over a range of low speeds above zero."""
    speeds = (0.02, 0.05, 0.1, 0.2)
    return bool(np.min(np.diff([_settled(law, v) for v in speeds])) < -_DULL)


def shows_presliding(law: Torque) -> bool:
    """Tell whether a microscopic push from rest meets a spring, not yet the sliding level."""
    time = np.linspace(0.0, 1.0, 1001)
    torque = law(time, np.full(1001, 1e-5))  # 0.01 mrad in all
    half, whole = float(torque[500]), float(torque[-1])
    return bool(whole < 0.5 and abs(whole - 2.0 * half) < 0.1 * whole)


def shows_varying_breakaway(law: Torque) -> bool:
    """Tell whether breakaway depends on how fast the joint is driven off."""
    return abs(_breakaway(law, 1e-3) - _breakaway(law, 1.0)) > _DULL


def shows_lag(law: Torque) -> bool:
    """Tell whether sliding friction differs between speeding up and slowing down, with rate.

    Velocity swings about a mean without reversal; a loop that a tenfold slower swing closes is
    lag, one that does not is a matter of travel.
    """

    def loop(hertz: float) -> float:
        time = np.linspace(0.0, 3.0 / hertz, 30001)
        velocity = 0.12 - 0.08 * np.cos(2.0 * np.pi * hertz * time)
        torque = law(time, velocity)
        last = slice(20000, 30001)
        area = np.trapezoid(torque[last], velocity[last])
        return abs(float(area))

    return loop(5.0) > 0.1 * _DULL and loop(5.0) > 2.0 * loop(0.5)


PHENOMENA: Mapping[str, Callable[[Torque], bool]] = MappingProxyType(
    {
        "Coulomb friction": shows_coulomb,
        "Viscous friction": shows_viscous,
        "Static friction": shows_static,
        "Stribeck friction": shows_stribeck,
        "Presliding displacement": shows_presliding,
        "Varying breakaway": shows_varying_breakaway,
        "Frictional lag": shows_lag,
    }
)
"""The rows of the table: what is asked of every law."""


def table() -> dict[str, dict[str, bool]]:
    """Return, by phenomenon and then by law, whether a simulation shows it."""
    return {
        phenomenon: {name: bool(shows(law)) for name, law in LAWS.items()}
        for phenomenon, shows in PHENOMENA.items()
    }
