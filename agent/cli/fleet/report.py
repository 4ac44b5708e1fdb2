"""From a lake's results to the fleet's page."""

from __future__ import annotations

from typing import Any

from agent.fleet.estimates import estimates_of
from agent.fleet.explanations import agreements, answers, in_words, questions
from agent.fleet.lake import Lake
from agent.fleet.roster import NO_MODEL, roster_of
from agent.fleet.verdicts import by_risk, present_stands, verdicts, verdicts_of
from agent.report.fleet import FleetPage
from agent.report.fleet_rows import AgreementRow, JointRow


def page_of(lake: Lake, detector: str) -> FleetPage:
    """Return what the page shows, from what was computed already.

    Raises
    ------
    agent.errors.InputError
        The lake's own files cannot be used.
    """
    roster = roster_of(lake)
    rows = by_risk(list(verdicts(verdicts_of(lake), present_stands(lake, detector), roster)))
    asked = list(questions(lake, roster))
    agreed = agreements(answers(lake, asked))
    recordings, poisoned = _estimated(lake)
    return FleetPage(
        lake=lake.url,
        joints=[_joint(r) for r in rows],
        agreements=[AgreementRow(in_words(a), a.asked, a.effects) for a in agreed],
        unusable=[*poisoned, *(f"{_name(r)}: {r['failure']}" for r in rows if r["failure"])],
        recordings=recordings,
    )


def _estimated(lake: Lake) -> tuple[int, list[str]]:
    """Return how many recordings have an estimate, and what the others lack."""
    import pyarrow as pa
    import pyarrow.compute as pc

    results = estimates_of(lake)
    number, poisoned = 0, []
    for month in results.months():
        rows = results.table(month, ("failure",))
        failed = rows.filter(pc.not_equal(rows.column("failure"), pa.scalar(""))).to_pylist()
        number += rows.num_rows - len(failed)
        poisoned += [f"{r['key']}: {r['failure']}" for r in failed]
    return number, poisoned


def _joint(row: dict[str, Any]) -> JointRow:
    """Return a joint of the page."""
    rise = (row["low_rise_percent"], row["low_rise_from_percent"], row["low_rise_to_percent"])
    return JointRow(
        site=row["site"],
        robot=row["robot"],
        axis=row["axis"],
        model="" if row["model"] == NO_MODEL else row["model"],
        state=row["state"] or "",
        sentence=row["sentence"] or row["failure"],
        last_cycle=row["last_cycle"] or "",
        rise_percent=None if None in rise else rise,
        coulomb_nm=row["coulomb_nm"],
        viscous_nm_s_per_rad=row["viscous_nm_s_per_rad"],
    )


def _name(row: dict[str, Any]) -> str:
    return f"{row['robot']} axis {row['axis']}"
