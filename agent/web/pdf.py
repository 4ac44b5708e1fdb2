"""The one-page report: what the page shows of a cycle, on paper (A4), for those who file it."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from agent.record.reading import read
from agent.record.recording import Recording
from agent.report.figures.canvas import styled
from agent.web.against import curve_of
from agent.web.shelf import Shelf, Shelved

if TYPE_CHECKING:
    from matplotlib.axes import Axes

A4_IN = (8.27, 11.69)
BLUE, GREEN, RED, INK = "#00598c", "#00664c", "#b3201a", "#14212b"
DRAWN = 4000
LINE = 92


def write_pdf(recording: Path, out: Path) -> None:
    """Write the report of one recording with the estimate and the verdict that stand beside it.

    Parameters
    ----------
    recording : pathlib.Path
        A Parquet file.
    out : pathlib.Path
        Where to.
    """
    samples = read(recording)
    cycle = Shelf().find(recording.parent, samples.metadata.robot, recording.stem)
    if cycle is None:
        raise FileNotFoundError(recording)
    _draw(samples, cycle, out)


@styled
def _draw(samples: Recording, cycle: Shelved, out: Path) -> None:
    from matplotlib.backends.backend_pdf import FigureCanvasPdf
    from matplotlib.figure import Figure

    figure = Figure(figsize=A4_IN)
    FigureCanvasPdf(figure)
    figure.text(0.09, 0.955, f"{cycle.metadata.robot}, axis {cycle.axis}", size=17, weight="bold")
    figure.text(0.09, 0.935, f"{cycle.started_at}   {cycle.trajectory}", size=9, color="#4b5863")
    text = "\n".join(textwrap.fill(line, LINE) for line in sentences(cycle))
    figure.text(0.09, 0.915, text, size=10, va="top", linespacing=1.4)
    _curve(figure.add_axes((0.12, 0.46, 0.8, 0.25)), cycle.estimate)
    drawn = [
        ("velocity_rad_s", "velocity, rad/s", BLUE),
        ("torque_nm", "torque, N m", GREEN),
        ("gearbox_temperature_degc", "gearbox, °C", RED),
    ]
    there = [entry for entry in drawn if entry[0] in samples]
    for place, (column, label, colour) in enumerate(there):
        axes = figure.add_axes((0.12, 0.3 - 0.115 * place, 0.8, 0.095))
        _trace(axes, samples, column, label, colour, last=place == len(there) - 1)
    software = cycle.metadata.software or "stribeck"
    figure.text(0.09, 0.025, f"{recording_line(cycle)}   {software}", size=7, color="#4b5863")
    figure.savefig(out, format="pdf", metadata={"Title": cycle.name, "CreationDate": None})


def sentences(cycle: Shelved) -> list[str]:
    """Return what the report says, a paragraph each."""
    estimate = cycle.estimate or {}
    said = [] if cycle.verdict is None else [cycle.verdict.sentence]
    own = str(estimate.get("sentence", ""))
    said += [own] if own and own not in said else []
    if cycle.stopped_because:
        said.append(f"Stopped before its end: {cycle.stopped_because}.")
    said += [f"Reason: {reason}" for reason in estimate.get("reasons", [])][:6]
    quality = estimate.get("quality")
    if isinstance(quality, Mapping):
        said.append(
            f"{quality.get('samples')} samples, {quality.get('samples_lost')} lost, at "
            f"{float(quality.get('sample_rate_hz') or 0.0):.0f} Hz."
        )
    return said or ["There is no estimate of this recording."]


def recording_line(cycle: Shelved) -> str:
    """Return which file the report is of."""
    sha256 = "" if cycle.verdict is None else f"   SHA-256 {cycle.verdict.recording_sha256}"
    return f"{cycle.path.name}{sha256}"


def _curve(axes: Axes, estimate: Mapping[str, Any] | None) -> None:
    curve = curve_of(estimate)
    axes.set_xlabel("motor velocity, rad/s")
    axes.set_ylabel("friction, N m")
    if curve is None:
        axes.text(0.5, 0.5, "no friction curve", transform=axes.transAxes, ha="center")
        return
    axes.errorbar(
        curve.velocity_rad_s,
        curve.friction_nm,
        yerr=curve.half_ci95_nm,
        color=BLUE,
        marker="o",
        ms=4,
        lw=1.4,
        capsize=3,
    )
    axes.set_title("Friction curve with 95 % intervals", size=10, loc="left", color=INK)


def _trace(
    axes: Axes, samples: Recording, column: str, label: str, colour: str, *, last: bool
) -> None:
    every = max(1, len(samples) // DRAWN)
    time_s = np.asarray(samples["time_s"], dtype=np.float64)[::every]
    axes.plot(time_s, np.asarray(samples[column], dtype=np.float64)[::every], color=colour, lw=0.8)
    axes.set_ylabel(label, size=8)
    axes.tick_params(labelbottom=last)
    if last:
        axes.set_xlabel("time, s")
