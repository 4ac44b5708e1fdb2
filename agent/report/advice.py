"""What to do about an estimate that cannot be made: the reason's words lead to the next step."""

from __future__ import annotations

from collections.abc import Iterable

# What it is about, words that a reason may contain, and what a technician does about it.
_STEPS: tuple[tuple[str, tuple[str, ...], str], ...] = (
    (
        "rate",
        ("too slow", "sample rate", "sampled at"),
        "Record faster: at least 100 samples a second, better 500, with every sample's own time.",
    ),
    (
        "motion",
        ("does not move", "samples of motion"),
        "Check that this axis was driven: released, enabled, and the right one.",
    ),
    (
        "torque",
        ("torque never changes", "torque is frozen", "no torque"),
        "Check the torque channel: which object of the drive it is, its scale, its rate.",
    ),
    (
        "saturation",
        ("cut off at a limit", "saturat"),
        "Drive gentler, so that the torque stays below the drive's limit: less acceleration first.",
    ),
    (
        "units",
        ("gear", "another unit", "other units", "position and velocity", "opposite signs"),
        "Check units, signs, gear ratio and counts: time is seconds, positions are radians on the "
        "motor side.",
    ),
    (
        "directions",
        ("one direction", "both directions", "revers"),
        "Drive both directions: every speed forward and backward over the same arm positions.",
    ),
    (
        "steady",
        ("steady",),
        "Drive the stair: some twenty velocities, each held until torque and velocity are steady.",
    ),
    (
        "temperature",
        ("cold", "warm", "temperature"),
        "Bring the gearbox to its working temperature first; the warm-up trajectory does that.",
    ),
    (
        "loss",
        ("lost", "frames", "valid samples"),
        "Find out why samples were lost (bus load, wiring, another program).",
    ),
)
_AGAIN = "record this axis again and estimate again. The present recording can stay."


def next_steps(reasons: Iterable[str]) -> tuple[str, ...]:
    """Return what to do now, each step once, in the order of the steps' table.

    Parameters
    ----------
    reasons : iterable of str
        Why the estimate is not decidable, in plain words.
    """
    chosen = advised(reasons)
    steps = tuple(step for id_, _words, step in _STEPS if id_ in chosen)
    return (*steps, f"Then {_AGAIN}" if steps else f"{_AGAIN[0].upper()}{_AGAIN[1:]}")


def advised(reasons: Iterable[str]) -> tuple[str, ...]:
    """Return what these steps are about, in their order, for other languages; ends with "again"."""
    said = " ".join(reasons).lower()
    ids = [id_ for id_, words, _step in _STEPS if any(word in said for word in words)]
    return (*ids, "again")
