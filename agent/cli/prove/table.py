"""The score as a table in a terminal; docs/proof.md shows the same."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from agent.cli.prove.misses import miss_lines
from agent.cli.prove.share import Share, quantile_text

Numbers = Mapping[str, Any]

_NAMES = (
    ("first", "first_right"),
    ("or of two", "in_small_set"),
    ("in set", "set_right"),
    ("exact", "exact"),
    ("ERR first", "baseline_first_right"),
    ("ERR all", "baseline_exact"),
)
_FALSE = (
    ("nulls: a false name", "nulls_with_false_name", "<= 2 %"),
    ("  one of what the joint does not have at all", "nulls_with_absent_name", ""),
    ("nulls: no mismatch", "nulls_without_mismatch", ""),
    ("outsiders: said to be unknown, and not misnamed", "outsiders_not_misnamed", ">= 90 %"),
    ("outsiders: map's first three cells", "outsiders_cell_right", ">= 80 %"),
    ("known effects: a name of what the joint does not have", "known_with_absent_name", ""),
    ("known effects: map's first three cells", "known_cell_right", ""),
)


def table_text(document: Numbers) -> str:
    """Return the table of a `stribeck.proof/1` document, 100 columns wide but for its last list.

    Parameters
    ----------
    document : mapping
        As `stribeck prove --json` writes it.
    """
    summary = document["summary"]
    head = [
        f"{document['made']} case{'s' * (document['made'] != 1)}, "
        f"seeds from {document['first_seed']}; "
        f"{len(document['dropped'])} more dropped, which the joint cannot show"
    ]
    if not document["counts_as_score"]:
        head.append("Seeds below 10000 are for development: this is no score.")
    parts = (
        head,
        _name_lines(summary["names"]),
        [_line(t, Share.of(summary["false_names"][k]).with_interval(), g) for t, k, g in _FALSE],
        _number_lines(summary["numbers"]),
        ["verdict expected -> given", *(_verdict_line(v) for v in summary["verdicts"])],
        miss_lines(document["cases"]),
    )
    return "\n\n".join("\n".join(part) for part in parts)


def _line(title: str, text: str, target: str) -> str:
    return f"{title:<54}{text:>34}{target:>12}".rstrip()


def _verdict_line(entry: Numbers) -> str:
    return f"  {entry['expected']:<18} -> {entry['given']:<18}{entry['cases']:5d}"


def _name_lines(names: Numbers) -> list[str]:
    """Return one line a group, and how the columns are to be read."""
    lines = [
        f"{'right names':<27}{'cases':>6}{''.join(f'{t:>10}' for t, _ in _NAMES)}{'size':>6}",
    ]
    for title, row in names.items():
        shares = "".join(f"{Share.of(row[key]).text():>10}" for _, key in _NAMES)
        size = "-" if row["mean_set_size"] is None else f"{row['mean_set_size']:.1f}"
        lines.append(f"{title:<27}{row['cases']:>6}{shares}{size:>6}")
    alike = names.get("look-alikes")
    if alike is not None:
        rival = Share.of(alike["rival_named"]).text()
        lines.append(f"look-alikes with the rival's name first: {rival}")
    lines += [
        "first: the name with the greatest share; or of two: or it is one of two that stay tied;",
        "in set: it or one of its alternatives, on average `size`; exact: all names, no false one;",
        "ERR: the baseline, first terms by error-reduction ratio; it is told how many there are.",
    ]
    return lines


_NUMBERS: tuple[tuple[str, str, str], ...] = (
    ("place: overlap with the label's, intersection/union", "overlap", ""),
    ("  0.8 and more", "overlap_reached", "all"),
    ("  the right order", "order_right", ""),
    ("energy share: error, points", "share_error", ""),
    ("  10 and less", "share_within_ten_points", "all"),
    ("rms on unseen recordings over the floor", "floor_ratio", "1.05, 1.15"),
    ("parameters at SNR 1 and up: error, %", "parameter_error", "<= 5"),
    ("  95 % intervals with the truth", "interval_has_truth", "90-98 %"),
    ("processor seconds a case", "processor_seconds", "<= 10"),
)
_WORDS: Mapping[str, tuple[tuple[float, float], str, float]] = {
    "overlap": ((0.5, 0.1), "median {:.2f}, p10 {:.2f}", 1.0),
    "share_error": ((0.5, 0.95), "median {:.0f}, p95 {:.0f}", 100.0),
    "floor_ratio": ((0.5, 0.95), "median {:.2f}, p95 {:.2f}", 1.0),
    "parameter_error": ((0.5, 0.9), "median {:.1f}, p90 {:.1f}", 100.0),
    "processor_seconds": ((0.5, 1.0), "median {:.1f}, most {:.1f}", 1.0),
}


def _number_lines(numbers: Numbers) -> list[str]:
    """Return one line a number: quantiles of lists, hits of shares."""
    lines = []
    for title, key, target in _NUMBERS:
        found = numbers[key]
        if key in _WORDS:
            text = quantile_text(found, *_WORDS[key])
        else:
            text = Share.of(found).with_interval()
        lines.append(_line(title, text, target))
    return lines
