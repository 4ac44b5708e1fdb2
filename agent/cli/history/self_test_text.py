"""A joint's self-test as JSON and as what a technician reads."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from agent.monitor.history.history import JointHistory
from agent.monitor.self_test.injection import SHAPES
from agent.monitor.self_test.result import Catch, SelfTest


@dataclass(frozen=True)
class AxisTest:
    """One joint's self-test; `answers` are the re-estimated recordings' shares by shape."""

    history: JointHistory
    found: SelfTest
    answers: dict[str, dict[str, float]]
    checked: tuple[str, ...]
    notes: tuple[str, ...]


def axis_json(tested: AxisTest) -> dict[str, Any]:
    """Return plain JSON; what is not a finite number is null."""
    found, alarms = tested.found, tested.found.false_alarms
    return {
        "robot": tested.history.joint.robot,
        "axis": tested.history.joint.axis,
        "decidable": not found.reason,
        "reason": found.reason,
        "passed": found.passed,
        "healthy_cycles": found.cycles,
        "baseline": found.baseline,
        "replays": found.replays,
        "block": found.block,
        "within_cycles": found.within,
        "rises": [_catch_json(c) for c in found.catches],
        "false_alarms": None
        if alarms is None
        else {
            "alarms": alarms.alarms,
            "cycles": alarms.cycles,
            "per_year": alarms.per_year,
            "ci95_per_year": list(alarms.ci95_per_year),
        },
        "checked": {"recordings": list(tested.checked), "answers": tested.answers},
        "notes": list(tested.notes),
    }


def _catch_json(catch: Catch) -> dict[str, Any]:
    return {
        "shape": catch.shape,
        "stated_percent": catch.stated_percent,
        "caught": catch.caught,
        "caught_share": catch.caught_share,
        "caught_share_ci95": list(catch.ci95_share),
        "delay_cycles": _finite(catch.delay_cycles),
        "smallest_percent": _finite(catch.smallest_percent),
        "smallest_ci95_percent": [_finite(end) for end in catch.ci95_percent],
        "smallest_nm": _finite(catch.smallest_nm),
    }


def axis_text(tested: AxisTest) -> str:
    """Return what a technician reads."""
    found = tested.found
    lines = [f"{tested.history.joint.label}:"]
    if found.reason:
        lines.append(f"  not decidable: {found.reason}.")
        return "\n".join([*lines, *(f"  note: {note}" for note in tested.notes)])
    lines.append(
        f"  {found.replays} replays of {found.cycles} healthy cycles (blocks of {found.block}), "
        f"baseline of {found.baseline}; caught within {found.within} cycles:"
    )
    lines += [f"  {line}" for catch in found.catches for line in _catch_lines(catch)]
    if found.false_alarms is not None:
        low, high = found.false_alarms.ci95_per_year
        plural = "s" * (found.false_alarms.alarms != 1)
        lines.append(
            f"  without a rise: {found.false_alarms.alarms} alarm{plural} in "
            f"{found.false_alarms.cycles} replayed cycles ({low:.2g} to {high:.2g} a year)"
        )
    if tested.answers:
        shares = [s for by_name in tested.answers.values() for s in by_name.values()]
        lines.append(
            f"  checked by estimating {len(tested.checked)} injected recordings anew: features "
            f"answer with {100.0 * min(shares):.0f} to {100.0 * max(shares):.0f} % of what was "
            "computed"
        )
    return "\n".join([*lines, *(f"  note: {note}" for note in tested.notes)])


def _catch_lines(catch: Catch) -> list[str]:
    low, high = catch.ci95_share
    verdict = "caught" if catch.caught else "NOT caught"
    lines = [
        f"- {SHAPES[catch.shape]}:",
        f"    {catch.stated_percent:g} % of low-speed friction: {verdict} in "
        f"{100.0 * catch.caught_share:.0f} % ({100.0 * low:.0f} to {100.0 * high:.0f} %)"
        + (f", after {_cycles(catch.delay_cycles)} (median)" if catch.caught_share > 0.0 else ""),
    ]
    if not math.isfinite(catch.smallest_percent):
        return [*lines, "    no rise up to twice the friction is caught with 95 %"]
    ends = [f"{e:.1f}" if math.isfinite(e) else "unknown" for e in catch.ci95_percent]
    return [
        *lines,
        f"    smallest caught with 95 %: {catch.smallest_percent:.1f} % ({ends[0]} to {ends[1]}), "
        f"{catch.smallest_nm:.3g} N m",
    ]


def _cycles(count: float) -> str:
    return "1 cycle" if round(count) == 1 else f"{count:.0f} cycles"


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
