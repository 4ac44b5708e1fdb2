"""The whole loop on the wire, every effect: ``python -m tests.benchmarks.wire [effect ...]``.

An effect is concealed in the fake drive's joint, its cell's stair is driven over the bus, the
recording is explained; where causes are tied, what is asked for is driven over the bus, too.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

from agent.explain.answer.result import Explanation
from tests.system.concealed_joints import CONCEALED, NULL, Concealed, ask_on, find


def said(found: Explanation) -> str:
    """Return verdict, how much is left over the noise, and every finding with its rivals."""
    names = []
    for finding in found.findings:
        rivals = ", ".join(f"{a.effect} {a.probability:.2f}" for a in finding.alternatives)
        names.append(
            f"{finding.effect} {finding.probability:.2f}" + (f" ({rivals})" if rivals else "")
        )
    ratio = found.extended.rmse_nm / found.floor.value_nm
    return f"{found.verdict}, {ratio:.2f} x noise: {' + '.join(names) or 'nothing'}"


def row(case: Concealed) -> bool:
    """Print one case; return whether it ends with the right name first, or with none for a null."""
    began = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        found = find(Path(folder), case)
        print(f"{case.effect or 'nothing':<32}{said(found.explanation)}", flush=True)
        following = found.explanation.next_experiment
        if following is not None and following.trajectory is not None:
            print(f"{'':<34}{following.sentence}")
            found = ask_on(Path(folder), case, found)
            print(f"{'':<34}then {said(found.explanation)}")
    first = [f.effect for f in found.explanation.findings[:1]]
    right = first == [case.effect] if case.effect else found.explanation.verdict == "no-mismatch"
    print(
        f"{'':<34}{'right' if right else 'WRONG'}, {time.process_time() - began:.1f} s", flush=True
    )
    return right


def main() -> None:
    """Print the table, and how many end as they should."""
    wanted = sys.argv[1:]
    cases = [
        case
        for name, case in {"nothing": NULL, **CONCEALED}.items()
        if not wanted or name in wanted
    ]
    right = [row(case) for case in cases]
    print(f"{sum(right)} of {len(right)} end as they should")


if __name__ == "__main__":
    main()
