"""The offline page of a fleet: which joint first and why, what models have in common."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from agent.record.atomic import publish
from agent.report.estimate import Picture
from agent.report.figures.canvas import data_uri
from agent.report.figures.fleet import figure_individuals, figure_rises
from agent.report.fleet_rows import STATES, AgreementRow, JointRow
from agent.report.page import render

_SHOWN, _LISTED = 40, 100


@dataclass(frozen=True)
class FleetPage:
    """What the page shows; `joints` with the most urgent first.

    `unusable` are the recordings and joints that could not be used, each with its reason.
    """

    lake: str
    joints: Sequence[JointRow]
    agreements: Sequence[AgreementRow]
    unusable: Sequence[str]
    recordings: int


def write_fleet_page(path: Path, page: FleetPage) -> Path:
    """Write the page, whole or not at all; a file that is there is replaced.

    Raises
    ------
    agent.errors.StorageError
        If the file cannot be written.
    """
    publish({path: fleet_html(page).encode()}, overwrite=True)
    return path


def fleet_html(page: FleetPage) -> str:
    """Return the page as text; the same input gives the same text."""
    urgent = [j for j in page.joints if j.state != "NF"]
    alike = [j for j in page.joints if j.model]  # of no known model nobody is anybody's peer
    rises = [j for j in page.joints if j.rise_percent is not None][:_SHOWN]
    return render(
        "fleet.html.j2",
        page=page,
        sentence=in_words(page),
        kind=_kind(page.joints),
        counts=[(*STATES[s], n) for s, n in _counted(page.joints)],
        urgent=urgent[:_LISTED],
        left_out=max(len(urgent) - _LISTED, 0),
        healthy=[j for j in page.joints if j.state == "NF"][:_LISTED],
        limit=_LISTED,
        rises=_rises(rises),
        individuals=_individuals(alike),
        models=_models(alike),
        unknown=_unknown(page.joints),
    )


def in_words(page: FleetPage) -> str:
    """Return what the fleet needs, in one sentence."""
    alarms = [j for j in page.joints if j.alarm]
    if not page.joints:
        return "No joint has been judged by this version yet: estimate and monitor the lake first."
    total = _count(len(page.joints), "joint")
    if not alarms:
        open_ = sum(j.state != "NF" for j in page.joints)
        if open_ == len(page.joints):
            return f"Of {total}, none can be decided yet."
        rest = f"; {open_} cannot be decided yet" if open_ else ""
        return f"Of {total}, none shows increased friction{rest}."
    first = alarms[0]
    return (
        f"Of {total}, {len(alarms)} show{'s' * (len(alarms) == 1)} increased friction; see to "
        f"{first.label} first."
    )


def _kind(joints: Sequence[JointRow]) -> str:
    """Return how the answer looks: to do, calm, or (nothing was decided) neither."""
    if not joints or any(j.alarm for j in joints):
        return "undecided"
    return "decided" if any(j.state == "NF" for j in joints) else "open"


def _counted(joints: Sequence[JointRow]) -> list[tuple[str, int]]:
    counts = Counter(j.state for j in joints)
    return [(state, counts[state]) for state in ("H1", "H0", "not-decidable", "", "NF")]


def _rises(joints: Sequence[JointRow]) -> Picture | None:
    if not joints:
        return None
    words = "; ".join(
        f"{j.label}: {j.rise_percent[0]:+.1f} %" for j in joints[:5] if j.rise_percent is not None
    )
    alt = f"Rise of low-speed friction of {_count(len(joints), 'joint')}. {words}."
    return Picture(data_uri(figure_rises(joints)), data_uri(figure_rises(joints, narrow=True)), alt)


def _individuals(joints: Sequence[JointRow]) -> Picture | None:
    known = [j for j in joints if j.coulomb_nm is not None]
    if not known:
        return None
    alt = f"Coulomb friction of {_count(len(known), 'joint')}, by model and axis."
    return Picture(
        data_uri(figure_individuals(known)), data_uri(figure_individuals(known, narrow=True)), alt
    )


def _unknown(joints: Sequence[JointRow]) -> str:
    """Return how many joints are compared with nobody, as nobody says what robots they are of."""
    number = sum(not j.model for j in joints)
    if not number:
        return ""
    left = f"{_count(number, 'joint')} {'is' if number == 1 else 'are'} compared with no other"
    return f"{left}: the robot's model is not recorded."


def _models(joints: Sequence[JointRow]) -> list[tuple[str, str, int, str, int]]:
    """Return model, axis, joints, range of Coulomb friction and alarms, one row a kind of joint."""
    kinds: dict[tuple[str, int], list[JointRow]] = defaultdict(list)
    for joint in joints:
        kinds[joint.model, joint.axis].append(joint)
    rows = []
    for (model, axis), own in sorted(kinds.items()):
        levels = sorted(j.coulomb_nm for j in own if j.coulomb_nm is not None)
        ends = list(dict.fromkeys(f"{level:.3g}" for level in (*levels[:1], *levels[-1:])))
        spread = " to ".join(ends) or "not known"
        rows.append((model, str(axis), len(own), spread, sum(j.alarm for j in own)))
    return rows


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'s' * (number != 1)}"
