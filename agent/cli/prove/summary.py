"""The score of many cases, counted: ready for JSON, and for the table."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from agent.cli.prove.plan import ALIKE, NULL, OUTSIDER, PAIR, POOR, RICH, TRIPLE
from agent.cli.prove.share import Share, share_of

Case = Mapping[str, Any]
Cases = Sequence[Case]
Test = Callable[[Case], bool]

_VISIBLE_SNR = 0.5
_NUMBERS_SNR = 1.0


def summary_of(cases: Cases) -> dict[str, Any]:
    """Return counts and quantiles over all cases, ready for JSON.

    Parameters
    ----------
    cases : sequence of mapping
        The `cases` of a `stribeck.proof/1` document.
    """
    return {
        "names": {title: _names(group) for title, group in _rows(cases) if group},
        "false_names": _false_names(cases),
        "numbers": _numbers(cases),
        "verdicts": [
            {"expected": expected, "given": given, "cases": count}
            for (expected, given), count in sorted(
                Counter(
                    (c["score"]["expected_verdict"], c["score"]["verdict"]) for c in cases
                ).items()
            )
        ],
    }


def _rows(cases: Cases) -> list[tuple[str, Cases]]:
    """Return the groups of cases in which something known is concealed."""
    rich = [c for c in cases if c["group"] == RICH]
    levels = sorted({c["snr"] for c in rich})
    out: list[tuple[str, Cases]] = [
        (f"one effect, SNR {snr:g}", [c for c in rich if c["snr"] == snr]) for snr in levels
    ]
    visible = [c for c in rich if c["snr"] >= _VISIBLE_SNR]
    out.append((f"one effect, SNR {_VISIBLE_SNR:g} and up", visible))
    for title, name in (
        ("look-alikes", ALIKE),
        ("one effect, poor cycle", POOR),
        ("two effects", PAIR),
        ("three effects", TRIPLE),
    ):
        out.append((title, [c for c in cases if c["group"] == name]))
    return out


def _names(cases: Cases) -> dict[str, Any]:
    """Return how often the right names were said, in one group."""
    sizes = [len(c["score"]["first_set"]) for c in cases if c["score"]["set_right"]]
    rivals = [c for c in cases if c["rival"] is not None]
    return {
        "cases": len(cases),
        "first_right": _count(cases, "first_right").to_json(),
        "in_small_set": _count(cases, "in_small_set").to_json(),
        "set_right": _count(cases, "set_right").to_json(),
        "mean_set_size": sum(sizes) / len(sizes) if sizes else None,
        "covered": _count(cases, "covered").to_json(),
        "exact": _count(cases, "exact").to_json(),
        "rival_named": share_of(rivals, _rival_named).to_json() if rivals else None,
        "baseline_first_right": _count(cases, "baseline_right").to_json(),
        "baseline_exact": _count(cases, "baseline_exact").to_json(),
    }


def _rival_named(case: Case) -> bool:
    """Return whether the look-alike stands first in the concealed effect's place."""
    first = case["score"]["first_set"][:1]
    return not case["score"]["first_right"] and first == [case["rival"]]


def _count(cases: Cases, name: str) -> Share:
    return share_of(cases, lambda c: bool(c["score"][name]))


def _false_names(cases: Cases) -> dict[str, Any]:
    """Return what was said where nothing known is concealed."""
    nulls = [c for c in cases if c["group"] == NULL]
    outsiders = [c for c in cases if c["group"] == OUTSIDER]
    known = [c for c in cases if c["group"] not in (NULL, OUTSIDER)]
    return {
        "nulls_with_false_name": share_of(nulls, lambda c: not c["score"]["exact"]).to_json(),
        "nulls_with_absent_name": share_of(nulls, lambda c: bool(c["score"]["absent"])).to_json(),
        "nulls_without_mismatch": _count(nulls, "verdict_right").to_json(),
        "outsiders_not_misnamed": _count(outsiders, "not_misnamed").to_json(),
        "outsiders_cell_right": _count(outsiders, "cell_right").to_json(),
        "known_with_absent_name": share_of(known, lambda c: bool(c["score"]["absent"])).to_json(),
        "known_cell_right": _count(
            [c for c in known if c["score"]["cell_right"] is not None], "cell_right"
        ).to_json(),
    }


def _numbers(cases: Cases) -> dict[str, Any]:
    """Return how good places, shares, predictions and parameters of right names are."""
    places = [p for c in cases for p in c["score"]["located"]]
    overlaps = [p["overlap"] for p in places if p["overlap"] is not None]
    orders = [p["order_right"] for p in places if p["order_right"] is not None]
    shares = [abs(p["share_error"]) for p in places if p["share_error"] is not None]
    numbers = [m for c in cases for m in c["score"]["measured"]]
    errors = [m["error"] for m in numbers if m["snr"] >= 0.9 * _NUMBERS_SNR]
    intervals = [m["covered"] for m in numbers if m["covered"] is not None]
    known = [c for c in cases if c["group"] != OUTSIDER]
    ratios = [c["score"]["floor_ratio"] for c in known if c["score"]["floor_ratio"] is not None]
    return {
        "overlap": overlaps,
        "overlap_reached": share_of(overlaps, lambda x: x >= 0.8).to_json(),
        "order_right": share_of(orders, bool).to_json(),
        "share_error": shares,
        "share_within_ten_points": share_of(shares, lambda x: x <= 0.1).to_json(),
        "floor_ratio": ratios,
        "parameter_error": errors,
        "parameter_within_five_percent": share_of(errors, lambda x: x <= 0.05).to_json(),
        "interval_has_truth": share_of(intervals, bool).to_json(),
        "processor_seconds": [c["processor_seconds"] for c in cases],
    }
