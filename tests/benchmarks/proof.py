"""Others on the cases of `stribeck prove`: ``python -m tests.benchmarks.proof [cases] [seed]``.

Needs scikit-learn, pysindy and sysidentpy (``uv run --group peers ...``), which the product does
not; what is not installed is said and left out. Every method sees the same recordings, rows, filter
and weights, and is judged on the same hold-outs. The sparse regressions are given our own physics:
of every effect the one form and point that fits best by itself, beside the twin's numbers, which
are projected out. So they are compared as choosers, not as libraries of polynomials. Gradient
boosting is given the signals and names nothing.

One setting of each sparse method was chosen on development seeds: ``... proof [cases] [seed] tune``
prints what others would have done.
"""

from __future__ import annotations

import importlib
import importlib.util
import sys
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from agent.cli.explain.simulate import read_twin
from agent.cli.prove.case import Sealed, answer, make
from agent.cli.prove.plan import Asked, plan
from agent.cli.prove.score import score
from agent.conclude.explanation import runs_of
from agent.explain.choosing.candidate import basis_of
from agent.explain.choosing.search import Library
from agent.explain.forms.library import judgeable
from agent.explain.rows.evidence import weigh
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import BASE, tabulate
from agent.identify.result import Floats
from agent.record.reading import read_all
from fakes.conceal import FIRST_SCORED_SEED, open_label

STLSQ, FROLS = 0.2, 0.05
TUNED: Mapping[str, tuple[float, ...]] = {
    "pysindy STLSQ": (0.05, 0.1, 0.2, 0.3),
    "sysidentpy FROLS": (0.005, 0.02, 0.05),
}
_MOST_TERMS = 8


@dataclass(frozen=True)
class Split:
    """Weighted rows of one case: what is learnt from (m rows), and what is predicted (h rows).

    `columns` (m + h, k) and `target` (m + h,) have the twin's own columns projected off, with
    coefficients that the training rows alone give; `effect` names each column's. `signals`
    (m + h, s) are plain; `weight` (m + h,) is one over N m.
    """

    columns: Floats
    target: Floats
    signals: Floats
    weight: Floats
    effect: tuple[str, ...]
    learnt: int

    def rms_nm(self, predicted: Floats) -> float:
        """Return what a prediction, shape (m + h,), leaves of the hold-outs."""
        left = ((self.target - predicted) / self.weight)[self.learnt :]
        return float(np.sqrt(np.mean(left**2)))


@dataclass(frozen=True)
class Said:
    """What a method names, the most important first, and its prediction, shape (m + h,)."""

    names: tuple[str, ...]
    predicted: Floats


Method = Callable[[Split], Said]


def split_of(folder: Path) -> Split:
    """Return the rows of a written case."""
    twin = read_twin(folder / "twin.toml")
    training = runs_of(read_all([folder / "training"]))
    table = tabulate(twin, (*training, *runs_of(read_all([folder / "holdout"]))))
    known = table.run < len(training)
    fitted = table.sliding & known
    delta = np.linalg.lstsq(table.base[fitted], table.target_nm[fitted], rcond=1e-9)[0]
    left = table.target_nm - table.base @ delta
    theta = np.array([getattr(twin, name) for name in BASE]) + delta
    scene = Scene(table, theta, np.where(table.used & known, left, 0.0))
    library = Library.of(scene, weigh(table, left), judgeable(table)[0])
    rows = library.weighing.rows
    order = np.argsort(~known[rows], kind="stable")
    order = order[known[rows][order] | table.sliding[rows][order]]  # unseen edges are not judged
    learnt = int(np.count_nonzero(known[rows]))
    columns, effect = _best_columns(library, order, learnt)
    target, base = library.target[order], library.base[order]
    signals = np.stack([_signal(scene, name)[rows][order] for name in _SIGNALS], axis=-1)
    return Split(
        _beside(base, columns, learnt),
        _beside(base, target[:, np.newaxis], learnt)[:, 0],
        signals,
        library.weighing.weight[order],
        effect,
        learnt,
    )


_SIGNALS = (
    "velocity_rad_s",
    "acceleration_rad_s2",
    "arm",
    "load",
    "cos",
    "sin",
    "travel_rad",
    "gearbox_temperature_degc",
    "motor_temperature_degc",
    "time_s",
)


def _signal(scene: Scene, name: str) -> Floats:
    """Return a signal at the rows, shape (n,)."""
    rows = scene.table.rows
    turn = rows["position_rad"]
    own = {"arm": scene.arm_rows, "load": scene.load_rows}
    if name in own:
        return own[name]()
    if name in ("cos", "sin"):
        return np.asarray(np.cos(turn) if name == "cos" else np.sin(turn))
    return np.asarray(rows[name], dtype=np.float64)


def _beside(base: Floats, columns: Floats, learnt: int) -> Floats:
    """Return columns less what the base makes of them on the rows that are learnt from."""
    size = np.sqrt(np.mean(base[:learnt] ** 2, axis=0))
    theta = np.linalg.lstsq(base[:learnt] / size, columns[:learnt], rcond=1e-9)[0]
    return np.asarray(columns - base / size @ theta)


def _best_columns(
    library: Library, order: np.ndarray[Any, np.dtype[np.int64]], learnt: int
) -> tuple[Floats, tuple[str, ...]]:
    """Return the columns of every effect's best candidate on the training rows, and whose."""
    basis = basis_of(library.base[order[:learnt]])
    target = library.target[order[:learnt]]
    best: dict[str, tuple[float, Floats]] = {}
    for candidate in library.candidates:
        columns = candidate.columns[order]
        own = columns[:learnt] - basis @ (basis.T @ columns[:learnt])
        gain = float(np.sum((basis_of(own, like=columns[:learnt]).T @ target) ** 2))
        effect = candidate.form.effect
        if gain > best.get(effect, (0.0, columns))[0]:
            best[effect] = gain, columns
    names = tuple(name for name, (_, c) in best.items() for _ in range(c.shape[1]))
    return np.concatenate([columns for _, columns in best.values()], axis=1), names


def _fitted(split: Split, chosen: list[int]) -> Said:
    """Return a least-squares model of chosen columns, named in their order."""
    names = tuple(dict.fromkeys(split.effect[i] for i in chosen))
    if not chosen:
        return Said((), np.zeros_like(split.target))
    learnt, columns = split.learnt, split.columns[:, chosen]
    theta = np.linalg.lstsq(columns[:learnt], split.target[:learnt], rcond=1e-9)[0]
    return Said(names, np.asarray(columns @ theta))


def one_term(split: Split) -> Said:
    """Return the baseline: the one effect that removes most."""
    target = split.target[: split.learnt]
    gains = {}
    for name in dict.fromkeys(split.effect):
        columns = split.columns[: split.learnt, [e == name for e in split.effect]]
        gains[name] = float(np.sum((basis_of(columns).T @ target) ** 2))
    best = max(gains, key=lambda name: gains[name])
    return _fitted(split, [i for i, name in enumerate(split.effect) if name == best])


def _scaled(split: Split) -> tuple[Floats, Floats]:
    """Return training columns and target, each of root mean square one."""
    columns, target = split.columns[: split.learnt], split.target[: split.learnt]
    size = np.maximum(np.sqrt(np.mean(columns**2, axis=0)), 1e-300)
    return columns / size, target / np.sqrt(np.mean(target**2))


def stlsq(threshold: float) -> Method:
    """Return sequentially thresholded least squares; the threshold is a share of the residual."""

    def method(split: Split) -> Said:
        columns, target = _scaled(split)
        optimizer = importlib.import_module("pysindy").STLSQ(threshold=threshold, alpha=1e-6)
        optimizer.fit(columns, target[:, np.newaxis])
        size = np.abs(np.asarray(optimizer.coef_, dtype=np.float64).ravel())
        return _fitted(split, [int(i) for i in np.argsort(-size) if size[i] > 0.0])

    return method


def frols(tolerance: float) -> Method:
    """Return forward regression; it ends when a term's error-reduction ratio is below."""

    def method(split: Split) -> Said:
        columns, target = _scaled(split)
        selection = importlib.import_module("sysidentpy.model_structure_selection")
        basis = importlib.import_module("sysidentpy.basis_function").Polynomial(degree=1)
        estimators = importlib.import_module("sysidentpy.parameter_estimation")
        model = selection.FROLS(
            order_selection=False,
            n_terms=_MOST_TERMS,
            xlag=[[1]] * columns.shape[1],
            model_type="NFIR",
            basis_function=basis,
            estimator=estimators.LeastSquares(),
        )
        # It looks one row back: the columns are moved one row ahead.
        model.fit(X=np.roll(columns, -1, axis=0), y=target[:, np.newaxis])
        chosen = [
            int(code[0]) // 1000 - 2  # 2001 is the first input one row ago; 0 is the constant
            for code, ratio in zip(model.final_model, model.err, strict=False)
            if ratio >= tolerance and int(code[0]) >= 2000
        ]
        return _fitted(split, chosen)

    return method


def boosted(split: Split) -> Said:
    """Return gradient boosting on what the refitted twin leaves; it has no names."""
    ensemble = importlib.import_module("sklearn.ensemble")
    learnt = split.learnt
    model = ensemble.HistGradientBoostingRegressor(
        max_iter=300, learning_rate=0.05, min_samples_leaf=100, random_state=0
    )
    model.fit(split.signals[:learnt], split.target[:learnt] / split.weight[:learnt])
    predicted = np.asarray(model.predict(split.signals), dtype=np.float64)
    return Said((), predicted * split.weight)


def methods(*, tune: bool) -> dict[str, Method]:
    """Return the methods whose package is there."""
    out: dict[str, Method] = {"error-reduction ratio, one term": one_term}
    makers: tuple[tuple[str, str, Callable[[float], Method], float], ...] = (
        ("pysindy", "pysindy STLSQ", stlsq, STLSQ),
        ("sysidentpy", "sysidentpy FROLS", frols, FROLS),
    )
    for package, title, maker, usual in makers:
        if importlib.util.find_spec(package) is None:
            print(f"{package} is not installed: left out")
            continue
        for value in TUNED[title] if tune else (usual,):
            out[f"{title} {value:g}"] = maker(value)
    if importlib.util.find_spec("sklearn") is None:
        print("scikit-learn is not installed: left out")
    else:
        out["gradient boosting"] = boosted
    return out


def rows_of(case: Asked, others: Mapping[str, Method]) -> list[tuple[str, bool, bool, float]]:
    """Return for every method: first name right, nothing false nor missing, hold-out rms ratio.

    The ratio is to the refitted twin's. Whatever a case cannot show gives no rows.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        sealed = make(case.order, folder)
        if not isinstance(sealed, Sealed):
            return []
        said, split = answer(folder), split_of(folder)
    label = open_label(sealed.label_text, sealed.salt, sealed.seal)
    own = score(label, said.explanation, ())
    unseen = said.explanation["holdout"]
    ratio = unseen["extended"]["rmse_nm"] / unseen["refitted"]["rmse_nm"]
    out = [("stribeck explain", own.first_right, own.exact, ratio)]
    before = split.rms_nm(np.zeros_like(split.target))
    for title, method in others.items():
        found = method(split)
        document = {
            "verdict": "explained",
            "findings": [
                {"effect": n, "form": "", "energy_share": 0.0, "where": [], "alternatives": []}
                | {"parameters": {}}
                for n in found.names
            ],
        }
        judged = score(label, document, ())
        after = split.rms_nm(found.predicted) / before
        out.append((title, judged.first_right, judged.exact, after))
    return out


def main() -> None:
    """Print the table."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 12
    first = int(sys.argv[2]) if len(sys.argv) > 2 else FIRST_SCORED_SEED
    others = methods(tune="tune" in sys.argv)
    found: dict[str, list[tuple[str, bool, bool, float]]] = {}
    for case in plan(count, first):
        for title, right, exact, ratio in rows_of(case, others):
            found.setdefault(title, []).append((case.group, right, exact, ratio))
    print(f"{'':<32}{'first':>8}{'exact':>8}{'nulls':>8}{'rms, median':>13}{'worst':>8}")
    for title, cases in found.items():
        known = [c for c in cases if c[0] not in ("null", "outsider")]
        nulls = [c for c in cases if c[0] == "null"]
        ratios = [c[3] for c in cases]
        named = title != "gradient boosting"
        shares = (
            f"{sum(c[1] for c in known)}/{len(known)}" if named else "-",
            f"{sum(c[2] for c in known)}/{len(known)}" if named else "-",
            f"{sum(c[2] for c in nulls)}/{len(nulls)}" if named else "-",
        )
        print(
            f"{title:<32}"
            + "".join(f"{share:>8}" for share in shares)
            + f"{np.median(ratios):13.2f}"
            f"{max(ratios):8.2f}"
        )


if __name__ == "__main__":
    main()
