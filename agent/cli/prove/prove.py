"""`stribeck prove`: conceal effects, explain them blind, open the labels, print the score."""

from __future__ import annotations

import contextlib
import json
import multiprocessing
import os
import signal
import tempfile
import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from shutil import rmtree
from typing import Any

import typer

from agent.cli.prove.case import Answer, Sealed, answer, make
from agent.cli.prove.plan import FULL, Asked, plan
from agent.cli.prove.score import Score, score
from agent.cli.prove.summary import summary_of
from agent.cli.prove.table import table_text
from agent.cli.terminal.talk import talker
from agent.cli.terminal.threads import LINEAR_ALGEBRA
from agent.errors import UsageError

SCHEMA = "stribeck.proof/1"
_MOST_PROCESSES = 64


@dataclass(frozen=True)
class Opened:
    """A case after the tool has answered: label and seal, answer, score."""

    asked: Asked
    sealed: Sealed
    label: dict[str, Any]
    answer: Answer
    score: Score

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON: enough to check the seal and to count again."""
        return {
            "number": self.asked.number,
            "group": self.asked.group,
            **asdict(self.asked.order),
            "seal": self.sealed.seal,
            "salt": self.sealed.salt,
            "label_text": self.sealed.label_text,
            "explanation": dict(self.answer.explanation),
            "seconds": self.answer.seconds,
            "processor_seconds": self.answer.processor_seconds,
            "score": self.score.to_json(),
        }


@dataclass(frozen=True)
class Dropped:
    """A case that the joint cannot show."""

    asked: Asked
    reason: str

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        return {
            "number": self.asked.number,
            "group": self.asked.group,
            **asdict(self.asked.order),
            "reason": self.reason,
        }


def run_prove(cases: int, first_seed: int, *, full: bool, processes: int, as_json: bool) -> None:
    """Make cases, explain them blind, score them, print the table.

    Raises
    ------
    agent.errors.InputError
        An argument cannot be used.
    """
    if not 1 <= processes <= _MOST_PROCESSES:
        raise UsageError(f"--processes: expected 1 to {_MOST_PROCESSES}, got {processes}.")
    asked = plan(FULL if full else cases, first_seed)
    opened: list[Opened] = []
    dropped: list[Dropped] = []
    # A request to end is answered like Ctrl-C, so that no recordings stay behind.
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        for outcome in outcomes(asked, processes):
            if isinstance(outcome, Opened):
                opened.append(outcome)
            else:
                dropped.append(outcome)
            talker().print(_progress(outcome, len(asked)))
    finally:
        signal.signal(signal.SIGTERM, before)
    document = proof_of(opened, dropped, first_seed)
    typer.echo(json.dumps(document, indent=2) if as_json else table_text(document))


def proof_of(
    opened: Sequence[Opened], dropped: Sequence[Dropped], first_seed: int
) -> dict[str, Any]:
    """Return the `stribeck.proof/1` document."""
    from fakes.conceal import FIRST_SCORED_SEED

    cases = [case.to_json() for case in opened]
    return {
        "schema": SCHEMA,
        "first_seed": first_seed,
        "counts_as_score": first_seed >= FIRST_SCORED_SEED,
        "asked": len(opened) + len(dropped),
        "made": len(opened),
        "dropped": [case.to_json() for case in dropped],
        "summary": summary_of(cases),
        "cases": cases,
    }


def outcomes(asked: Sequence[Asked], processes: int) -> Iterator[Opened | Dropped]:
    """Yield every case in order as it is opened, `processes` of them under way at a time."""
    with _workers(processes) as pool, ThreadPoolExecutor(processes) as drivers:
        under_way: list[Future[Opened | Dropped]] = [
            drivers.submit(_through, pool, case) for case in asked
        ]
        try:
            for future in under_way:
                yield future.result()
        except BaseException:  # Ctrl-C or an error: nobody waits for cases that nobody will see
            for future in under_way:
                future.cancel()
            for process in multiprocessing.active_children():
                process.terminate()
            raise


@contextlib.contextmanager
def _workers(count: int) -> Iterator[Executor]:
    """Yield processes of their own, each with one thread for linear algebra.

    They are started afresh, not forked, so that what is set here is set before NumPy is loaded.
    """
    before = {name: os.environ.get(name) for name in LINEAR_ALGEBRA}
    os.environ.update(dict.fromkeys(LINEAR_ALGEBRA, "1"))
    pool = ProcessPoolExecutor(
        count,
        mp_context=multiprocessing.get_context("spawn"),
        initializer=_begin_worker,
    )
    try:
        yield pool
    finally:
        pool.shutdown(cancel_futures=True)
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _begin_worker() -> None:
    """Leave Ctrl-C to the parent, and end with it, however it ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _through(pool: Executor, case: Asked) -> Opened | Dropped:
    """Take one case from its making to its score; the label stays here while it is explained."""
    from fakes.conceal import open_label

    folder = Path(tempfile.mkdtemp(prefix="stribeck-prove-"))
    try:
        sealed = pool.submit(make, case.order, folder).result()
        if isinstance(sealed, str):
            return Dropped(case, sealed)
        talker().print(f"case {case.number}: sealed {sealed.seal}")
        said = pool.submit(answer, folder).result()
    finally:
        rmtree(folder, ignore_errors=True)
    label = open_label(sealed.label_text, sealed.salt, sealed.seal)
    return Opened(case, sealed, label, said, score(label, said.explanation, said.baseline))


def _progress(outcome: Opened | Dropped, count: int) -> str:
    """Return one line on a case that is done."""
    order, number = outcome.asked.order, outcome.asked.number
    concealed = " + ".join(order.effects) or "nothing"
    begin = f"case {number} of {count}, {order.design}, SNR {order.snr:g}: {concealed}"
    if isinstance(outcome, Dropped):
        return f"{begin}: dropped, {outcome.reason}"
    found = " + ".join(outcome.score.named) or "no name"
    return f"{begin} -> {found} ({outcome.score.verdict}, {outcome.answer.seconds:.1f} s)"
