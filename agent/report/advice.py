"""What to do about an estimate that cannot be made: the reason's words lead to the next step."""

from __future__ import annotations

from collections.abc import Iterable

# Words that a reason may contain, and what a technician does about it.
_STEPS: tuple[tuple[tuple[str, ...], str], ...] = (
    (
        ("rate", "too slow", "too slowly", "hz"),
        "Record faster: at least 100 samples a second, better 500, with every sample's own time.",
    ),
    (
        ("revers", "one direction", "both directions", "one way"),
        "Drive both directions: every speed forward and backward over the same arm positions.",
    ),
    (
        ("window", "steady", "speeds", "velocities", "stair"),
        "Drive the stair: some twenty velocities, each held until torque and velocity are steady.",
    ),
    (
        ("cold", "temperature", "warm"),
        "Bring the gearbox to its working temperature first; the warm-up trajectory does that.",
    ),
    (
        ("lost", "frame", "missing", "gap"),
        "Find out why samples were lost (bus load, wiring, another program) and record again.",
    ),
    (
        ("no torque", "torque is constant", "torque does not"),
        "Check the torque channel: its source, its scale, and that the drive reports it at all.",
    ),
)
_ALWAYS = "Record the stair again on this axis, then estimate again. Nothing needs to be deleted."


def next_steps(reasons: Iterable[str]) -> tuple[str, ...]:
    """Return what to do now, each step once, in the order of the steps' table.

    Parameters
    ----------
    reasons : iterable of str
        Why the estimate is not decidable, in plain words.
    """
    said = " ".join(reasons).lower()
    steps = [step for words, step in _STEPS if any(word in said for word in words)]
    return (*steps, _ALWAYS)
