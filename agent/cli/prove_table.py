"""The score of many cases, as numbers and as the table that docs/proof.md prints."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from agent.cli.prove_misses import miss_lines
from agent.cli.prove_plan import ALIKE, NULL, OUTSIDER, PAIR, POOR, RICH, TRIPLE
from agent.cli.prove_share import Share, quantile_text, share_of

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
        "nulls_with_absent_name": share_of(nulls, lambda c: bool(c["score"]["absent"])).to_json(),
        "nulls_with_small_name": share_of(
            nulls, lambda c: bool(c["score"]["too_small"]) and not c["score"]["absent"]
        ).to_json(),
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
    shares = [abs(p["share_error"]) for p in places]
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


def table_text(document: Mapping[str, Any]) -> str:
    """Return the table of a `stribeck.proof/1` document, no line longer than 100 columns."""
    summary = document["summary"]
    seeds = f"seeds from {document['first_seed']}"
    head = [f"{document['made']} cases, {seeds}; {len(document['dropped'])} dropped: not reachable"]
    if not document["counts_as_score"]:
        head.append("Seeds below 10000 are for development: this is no score.")
    return "\n".join(
        [
            *head,
            "",
            *_name_lines(summary["names"]),
            "",
            *_false_lines(summary["false_names"]),
            "",
            *_number_lines(summary["numbers"]),
            "",
            "verdict expected -> given",
            *(
                f"  {v['expected']:<18} -> {v['given']:<18}{v['cases']:5d}"
                for v in summary["verdicts"]
            ),
            "",
            *miss_lines(document["cases"]),
        ]
    )


_COLUMNS = (
    ("first", "first_right"),
    ("or of two", "in_small_set"),
    ("in set", "set_right"),
    ("exact", "exact"),
    ("ERR first", "baseline_first_right"),
    ("ERR all", "baseline_exact"),
)


def _name_lines(names: Mapping[str, Any]) -> list[str]:
    width = 10
    lines = [
        f"{'right names':<27}{'cases':>6}"
        + "".join(f"{title:>{width}}" for title, _ in _COLUMNS)
        + f"{'size':>6}"
    ]
    for title, row in names.items():
        size = "-" if row["mean_set_size"] is None else f"{row['mean_set_size']:.1f}"
        lines.append(
            f"{title:<27}{row['cases']:>6}"
            + "".join(f"{Share.of(row[key]).text():>{width}}" for _, key in _COLUMNS)
            + f"{size:>6}"
        )
    alike = names.get("look-alikes")
    if alike is not None:
        rival = Share.of(alike["rival_named"])
        lines.append(f"look-alikes with the rival's name first: {rival.text()}")
    return lines


def _false_lines(false: Mapping[str, Any]) -> list[str]:
    return [
        f"{title:<60}{Share.of(false[key]).with_interval():>26}{target:>12}"
        for title, key, target in (
            ("nulls: a name of what the joint does not have", "nulls_with_absent_name", "<= 2 %"),
            ("nulls: only names of what it has less than 2 % of", "nulls_with_small_name", ""),
            ("nulls: no mismatch", "nulls_without_mismatch", ""),
            (
                "outsiders: said to be unknown, and not misnamed",
                "outsiders_not_misnamed",
                ">= 90 %",
            ),
            ("outsiders: map's first three cells", "outsiders_cell_right", ">= 80 %"),
            ("known effects: a name of what the joint does not have", "known_with_absent_name", ""),
            ("known effects: map's first three cells", "known_cell_right", ""),
        )
    ]


def _number_lines(numbers: Mapping[str, Any]) -> list[str]:
    return [
        f"{title:<46}{text:>40}{target:>12}"
        for title, text, target in (
            (
                "place: intersection over union",
                quantile_text(numbers["overlap"], (0.1, 0.5), "p10 {:.2f}, median {:.2f}"),
                "",
            ),
            ("  0.8 and more", Share.of(numbers["overlap_reached"]).with_interval(), "all"),
            ("  the right order", Share.of(numbers["order_right"]).with_interval(), ""),
            (
                "energy share: error, points",
                quantile_text(
                    numbers["share_error"], (0.5, 0.95), "median {:.0f}, p95 {:.0f}", 100.0
                ),
                "",
            ),
            ("  10 and less", Share.of(numbers["share_within_ten_points"]).with_interval(), "all"),
            (
                "rms on unseen recordings over the floor",
                quantile_text(numbers["floor_ratio"], (0.5, 0.95), "median {:.2f}, p95 {:.2f}"),
                "1.05, 1.15",
            ),
            (
                "parameters at SNR 1 and up: error, %",
                quantile_text(
                    numbers["parameter_error"], (0.5, 0.9), "median {:.1f}, p90 {:.1f}", 100.0
                ),
                "<= 5",
            ),
            (
                "  95 % intervals with the truth",
                Share.of(numbers["interval_has_truth"]).with_interval(),
                "90-98 %",
            ),
            (
                "processor seconds a case",
                quantile_text(
                    numbers["processor_seconds"], (0.5, 1.0), "median {:.1f}, most {:.1f}"
                ),
                "<= 10",
            ),
        )
    ]
