"""Numbers that all come out off by one factor beside a law, and are too little of all to be told.

A cable of ten times the noise makes a torque constant that is 7 % off a percent of the mismatch:
less than a number's ordinary uncertainty is worth beside it. But inertia and friction have nothing
in common but the torque in which they are told, and that they all moved alike is no uncertainty.
"""

from __future__ import annotations

from agent.explain.answer.amounts import factor, percent
from agent.explain.study import Study

_ASKED = ("inertia_kg_m2", "viscous_nm_s_per_rad", "coulomb_nm")
_OFF = 0.03  # of a number: drives know their torque to that
_SURE = 2  # intervals that leave out what the twin says


def off_alike_said(found: Study) -> str:
    """Return that the twin's numbers all moved by one factor; nothing where they did not.

    Parameters
    ----------
    found : Study
    """
    if found.numbers or not found.choice.terms:
        return ""
    ratios: list[tuple[float, float, float]] = []
    for name in _ASKED:
        given, number = float(getattr(found.twin, name)), found.model.base[name]
        if not given > 0.0 or number.ci95 is None:
            return ""
        ratios.append((number.ci95[0] / given, number.value / given, number.ci95[1] / given))
    low, high = max(r[0] for r in ratios), min(r[2] for r in ratios)
    sure = sum(not r[0] <= 1.0 <= r[2] for r in ratios)
    # The one that is known best says how far: it must be in every other's interval.
    common = min(ratios, key=lambda r: r[2] - r[0])[1]
    if not low <= common <= high or abs(common - 1.0) < _OFF or sure < _SURE:
        return ""
    way = "larger" if common > 1.0 else "smaller"
    return (
        "beside what was found the simulation's inertia, Coulomb and viscous friction all come out "
        f"{percent(abs(common - 1.0))} {way}, as where the real torque is the reported one times "
        f"{factor(1.0 / common)}: too little of this mismatch to be told as a wrong number, and "
        "gravity, where it is held as given, is off by as much"
    )
