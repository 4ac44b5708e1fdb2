"""The deficiency map: which number of the twin would have to vary, along which axis.

Each base parameter may vary smoothly along each axis; a cell's gain is the share of the residual's
energy that this removes on blocks it was not fitted to. Its p-value comes from the same search on
residuals that were shifted in a circle within their recordings, with a gamma law fitted to the
shifted gains so that small values can be told; Benjamini and Yekutieli (Ann. Statist. 29 (2001)
1165) keep false discoveries below 5 % under any dependence between the cells.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np

from agent.explain.answer.result import Cell
from agent.explain.choosing.candidate import Candidate, basis_of
from agent.explain.choosing.search import Library
from agent.explain.choosing.shifts import energies_in, shifted
from agent.explain.forms.orders import strong_orders
from agent.explain.rows.evidence import heldout, moments
from agent.explain.rows.lines import Line
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import BASE, GRAVITY_AT
from agent.identify.result import Floats

MATERIAL = 0.02
_KNOTS = 7
_FALSE = 0.05
_TOGETHER = 16  # cells: all at once would be another library in memory
_NAMES = ("offset", *BASE[:3], "gravity", "scale")


@dataclass(frozen=True)
class Axis:
    """One axis: its word of contract section 6, and smooth functions of it at the rows (n, k)."""

    variable: str
    functions: Floats
    values: Floats


def axes_of(scene: Scene) -> tuple[Axis, ...]:
    """Return the axes that these recordings have."""
    table = scene.table
    rows = table.rows
    speed = np.abs(rows["velocity_rad_s"])
    out = [
        _smooth("velocity_rad_s", np.log(np.maximum(speed, 0.2 * scene.slowest)), scene),
        Axis("direction", np.sign(rows["velocity_rad_s"])[:, np.newaxis], rows["velocity_rad_s"]),
        _smooth("acceleration_rad_s2", rows["acceleration_rad_s2"], scene),
        _smooth("after_reversal_rad", np.log(np.maximum(rows["travel_rad"], 1e-3)), scene),
        _smooth("time_s", rows["time_s"], scene),
    ]
    if scene.has("position_rad"):
        out.append(_smooth("arm_position_rad", scene.arm_rows(), scene))
        out.append(_smooth("load_torque_nm", np.abs(scene.load_rows()), scene))
        for order in strong_orders(scene, "torque")[:2]:
            angle = order * rows["position_rad"]
            waves = np.stack([f(k * angle) for k in (1, 2) for f in (np.cos, np.sin)], axis=-1)
            out.append(Axis(f"order_per_motor_rev {order:.6g}", waves, angle))
    out += [
        _smooth(name, rows[name], scene)
        for name in ("gearbox_temperature_degc", "motor_temperature_degc")
        if scene.has(name)
    ]
    if len(table.runs) > 1:
        if scene.has("elapsed_s"):
            out.append(_smooth("elapsed_s", rows["elapsed_s"], scene))
        levels = (table.run[:, np.newaxis] == np.unique(table.run)[1:]).astype(np.float64)
        out.append(Axis("recording", levels, table.run.astype(np.float64)))
    return tuple(axis for axis in out if axis.functions.shape[1])


def _smooth(variable: str, values: Floats, scene: Scene) -> Axis:
    """Return hat functions over quantiles of an axis, the constant among them left out."""
    inside = values[scene.table.sliding]
    if not inside.size:
        return Axis(variable, np.zeros((values.shape[0], 0)), values)
    knots = np.unique(np.quantile(inside, np.linspace(0.0, 1.0, _KNOTS)))
    if knots.size < 2 or np.ptp(knots) <= 0.0:
        return Axis(variable, np.zeros((values.shape[0], 0)), values)
    held = np.clip(values, knots[0], knots[-1])
    hats = np.stack(
        [np.interp(held, knots, np.eye(knots.size)[i]) for i in range(1, knots.size)], axis=-1
    )
    return Axis(variable, hats - hats[scene.table.sliding].mean(axis=0), values)


def is_loaded(scene: Scene) -> bool:
    """Return whether the twin as given has a weight: a refitted one may be noise alone."""
    return bool(np.any(scene.as_given[GRAVITY_AT]))


def parameters_of(scene: Scene) -> Mapping[str, Floats]:
    """Return the column of every base parameter at the rows, shape (n,)."""
    base = scene.table.base
    predicted = base @ scene.theta
    gravity = base[:, 3:5] @ scene.theta[3:5] if is_loaded(scene) else base[:, 3]
    own = base[:, :3] * scene.table.carried[:3]
    columns = (np.ones(base.shape[0]), own[:, 0], own[:, 1], own[:, 2], gravity, predicted)
    return {n: c for n, c in zip(_NAMES, columns, strict=True) if np.any(c)}


def deficiency_map(
    library: Library, terms: Sequence[Candidate] = (), lines: Sequence[Line] = ()
) -> tuple[Cell, ...]:
    """Return every cell of the map of a model's residual, the greatest gain first.

    Parameters
    ----------
    library : Library
    terms : sequence of Candidate
        What the model has beside its base.
    lines : sequence of Line
        Of the model's residual: each is a cell of the offset along the frequency.
    """
    weighing = library.weighing
    model = library.model(terms)
    basis = basis_of(model)
    left = library.target - basis @ (basis.T @ library.target)
    energy = float(left @ left)
    plain = heldout(moments(model, library.target, weighing.starts), weighing.fold)
    drawn = shifted(library.weighing, left)
    cells = []
    spaces = _spaces(library, basis)
    while several := list(islice(spaces, _TOGETHER)):
        nulls = energies_in([own for *_, own in several], drawn)
        for (name, variable, own), null in zip(several, nulls, strict=True):
            part = moments(np.concatenate((model, own), axis=1), library.target, weighing.starts)
            gain = 1.0 - float(heldout(part, weighing.fold).sum()) / float(plain.sum())
            share = float(np.sum((own.T @ left) ** 2)) / energy
            cells.append((name, variable, gain, _tail(share, null / energy)))
    cells += [("offset", line.axis, line.share, line.p_value) for line in lines]
    counted = _discoveries([p for *_, p in cells])
    out = [
        Cell(name, variable, gain, p, bool(passes and gain > MATERIAL))
        for (name, variable, gain, p), passes in zip(cells, counted, strict=True)
    ]
    return tuple(sorted(out, key=lambda cell: -cell.gain))


def _spaces(library: Library, basis: Floats) -> Iterator[tuple[str, str, Floats]]:
    """Yield every cell's parameter, axis and orthonormal functions beside a model, shape (m, k)."""
    for axis in axes_of(library.scene):
        for name, column in parameters_of(library.scene).items():
            columns = library.weighing.weighted(column[:, np.newaxis] * axis.functions)
            own = basis_of(columns - basis @ (basis.T @ columns), like=columns)
            if own.shape[1]:
                yield name, axis.variable, own


def _tail(share: float, null: Floats) -> float:
    """Return how likely a gain is under a gamma law of the mean and variance of the null's."""
    from scipy.special import gammaincc

    mean, variance = float(null.mean()), float(null.var())
    if mean <= 0.0 or variance <= 0.0:
        return 1.0
    return float(gammaincc(mean**2 / variance, share * mean / variance))


def _discoveries(p_values: Sequence[float]) -> list[bool]:
    """Return which hypotheses pass Benjamini and Yekutieli's step-up rule."""
    count = len(p_values)
    if not count:
        return []
    p = np.array(p_values)
    order = np.argsort(p)
    harmonic = float(np.sum(1.0 / np.arange(1, count + 1)))
    limit = _FALSE * np.arange(1, count + 1) / (count * harmonic)
    below = np.flatnonzero(p[order] <= limit)
    passed = np.zeros(count, dtype=bool)
    if below.size:
        passed[order[: below[-1] + 1]] = True
    return [bool(x) for x in passed]
