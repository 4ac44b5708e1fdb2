"""One case: made and sealed here, explained there by what sees its files alone.

`make` and `answer` run in processes of their own. What goes from one to the other is a folder with
recordings and a twin; its name and theirs tell nothing.
"""

from __future__ import annotations

import secrets
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fakes.conceal import Order
    from trajectories import AxisLimits

CRASHED = "crashed"
_MOST_TERMS = 3


@dataclass(frozen=True)
class Sealed:
    """A concealed case while it is explained: the label's text stays with whoever made it.

    Parameters
    ----------
    seal : str
        HMAC-SHA256 of `label_text` under `salt`, in hex; known before the tool begins.
    salt : str
        Drawn for this case; it keeps the label from being guessed from its seal.
    label_text : str
        The label as canonical JSON.
    """

    seal: str
    salt: str
    label_text: str


@dataclass(frozen=True)
class Answer:
    """What the tool said, and what the baseline would have said.

    Parameters
    ----------
    explanation : mapping
        The `stribeck.explanation/1` document.
    baseline : tuple of str
        Effects by error-reduction ratio, the first term first.
    seconds, processor_seconds : float
        Of the tool, reading included, the baseline not: by the clock, and of one processor, which
        what else the machine does hardly changes.
    """

    explanation: Mapping[str, Any]
    baseline: tuple[str, ...]
    seconds: float
    processor_seconds: float


def make(order: Order, folder: Path) -> Sealed | str:
    """Conceal a case, write what the tool may see into `folder`, and seal the label.

    Returns
    -------
    Sealed or str
        Why the joint cannot show the effect, where it cannot: such a case is dropped and counted.
    """
    from fakes.conceal import UnreachableError, canonical, conceal, seal, write_case

    try:
        case = conceal(order.seed, effects=order.effects, design=order.design, snr=order.snr)
    except UnreachableError as reason:
        return str(reason)
    write_case(case, folder)
    salt = secrets.token_hex(16)
    return Sealed(seal(case.label, salt), salt, canonical(case.label))


def answer(folder: Path, limits: AxisLimits | None = None) -> Answer:
    """Explain the recordings of a folder as `stribeck explain` does; nothing else is known.

    Parameters
    ----------
    folder : Path
        With `training`, `holdout` and `twin.toml`, as `make` leaves them.
    limits : AxisLimits, optional
        Of the axis, as ``--cell`` gives them: the next experiment may then leave what was driven.
    """
    from agent.cli.explain.simulate import read_twin
    from agent.cli.prove.baseline import first_terms
    from agent.conclude.explanation import explained, runs_of
    from agent.record.reading import read_all

    began = time.perf_counter(), time.process_time()
    path = folder / "twin.toml"
    twin = read_twin(path)
    recordings = read_all([folder / "training"])
    unseen = read_all([folder / "holdout"])
    document: Mapping[str, Any]
    try:
        document = explained(twin, path, recordings, unseen, limits).to_json()
    except Exception as error:  # noqa: BLE001 - a tool that fails on a case has missed it: counted
        document = {"verdict": CRASHED, "reasons": [f"{type(error).__name__}: {error}"]}
    seconds = time.perf_counter() - began[0], time.process_time() - began[1]
    crashed = document["verdict"] == CRASHED
    baseline = () if crashed else first_terms(twin, runs_of(recordings), _MOST_TERMS)
    return Answer(document, baseline, *seconds)
