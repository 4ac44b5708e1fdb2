"""The offline report of an estimate: one HTML file that needs neither network nor script."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from agent.identify.result import Estimate
from agent.numbers import units_unbroken
from agent.record.atomic import publish
from agent.report import provenance, rows
from agent.report.advice import next_steps
from agent.report.figures.canvas import data_uri
from agent.report.figures.curve import figure_friction_curve, friction_curve_in_words
from agent.report.figures.cycle import cycle_in_words, figure_cycle
from agent.report.figures.prediction import figure_prediction, prediction_in_words
from agent.report.laws import model_label
from agent.report.page import render
from agent.report.views import EstimateViews, RecordingView

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RECORDINGS_DRAWN = 3


@dataclass(frozen=True)
class Picture:
    """A figure in both widths, with its words for those who do not see it."""

    wide_uri: str
    narrow_uri: str
    alt: str
    heading: str = ""
    marked: bool = True


def write_estimate_report(
    path: Path,
    estimate: Estimate,
    views: EstimateViews,
    *,
    title: str = "",
    robot: str = "",
    axis: int | str = "",
    metadata: Mapping[str, object] | None = None,
) -> Path:
    """Write the report; the file is there whole or not at all.

    Parameters
    ----------
    path : Path
        Where to; the folder must exist. A file that is there is replaced.
    estimate : Estimate
        What is reported.
    views : EstimateViews
        The recordings behind it and what identify made of them.
    title, robot : str
        As the user calls them; untrusted, escaped.
    axis : int or str
        As the cell numbers it.
    metadata : mapping, optional
        The recording's metadata (contract section 2): drive identity, trajectory, software.

    Returns
    -------
    Path
        The file written.

    Raises
    ------
    agent.errors.StorageError
        If the file cannot be written.
    """
    html = estimate_html(
        estimate, views, title=title, robot=robot, axis=axis, metadata=metadata or {}
    )
    publish({path: html.encode("utf-8")}, overwrite=True)
    return path


def estimate_html(
    estimate: Estimate,
    views: EstimateViews,
    *,
    title: str = "",
    robot: str = "",
    axis: int | str = "",
    metadata: Mapping[str, object] | None = None,
) -> str:
    """Return the page as text; the same input gives the same text. See `write_estimate_report`."""
    drawn = views.recordings[:RECORDINGS_DRAWN]
    decided = estimate.decidable
    notes, methods = rows.notes_as_sentences(estimate)
    return render(
        "estimate.html.j2",
        title=title or "Friction estimate",
        robot=robot,
        axis=str(axis),
        estimate=estimate,
        decidable=decided,
        sentence=_sentence(estimate),
        notes=notes,
        methods=methods,
        next_steps=() if decided else next_steps(estimate.reasons),
        tiles=rows.tiles(estimate) if decided else (),
        groups=rows.parameter_groups(estimate) if decided else (),
        models=rows.model_rows(estimate.friction_models) if decided else (),
        model_error_unit=rows.model_error_scale(estimate.friction_models).unit,
        curve_points=rows.curve_points(estimate.friction_curve) if decided else None,
        curve_picture=_curve_picture(estimate) if decided else None,
        cycle_pictures=[_cycle_picture(view, drawn) for view in drawn],
        prediction_pictures=_prediction_pictures(drawn) if decided else [],
        recordings_undrawn=len(views.recordings) - len(drawn),
        rigid=rows.rigid_rows(estimate) if decided else (),
        quality=provenance.quality_rows(estimate.quality),
        recordings=provenance.recording_rows(views.recordings),
        about=provenance.metadata_rows(metadata or {}),
    )


def _sentence(estimate: Estimate) -> str:
    """Return the verdict: the estimate's own, composed where it brings none.

    What is not decidable says so once; the reasons stand below it as a list.
    """
    if not estimate.decidable:
        return "These recordings do not carry a friction estimate."
    if estimate.sentence:
        return units_unbroken(estimate.sentence)
    numbers = [
        f"{tile.label.lower()} is {tile.value} {tile.unit}"
        + (f" ({tile.detail})" * bool(tile.detail))
        for tile in rows.tiles(estimate)
        if tile.label.endswith("friction")
    ]
    selected = estimate.selected_model
    law = [f"the {model_label(selected.model)} law fits best"] if selected else []
    sentence = "; ".join([" and ".join(numbers)] * bool(numbers) + law) or "the estimate is made"
    return units_unbroken(f"{sentence[0].upper()}{sentence[1:]}.")


def _curve_picture(estimate: Estimate) -> Picture | None:
    curve, models = estimate.friction_curve, estimate.friction_models
    if curve is None or curve.velocity_rad_s.size == 0:
        return None
    wide = figure_friction_curve(curve, models)
    narrow = figure_friction_curve(curve, models, narrow=True)
    return _picture(wide, narrow, friction_curve_in_words(curve, models))


def _cycle_picture(view: RecordingView, drawn: Sequence[RecordingView]) -> Picture:
    return Picture(
        data_uri(figure_cycle(view)),
        data_uri(figure_cycle(view, narrow=True)),
        cycle_in_words(view),
        _heading(view, drawn),
        marked=bool(view.windows),
    )


def _prediction_pictures(drawn: Sequence[RecordingView]) -> list[Picture]:
    return [
        _picture(
            figure_prediction(view),
            figure_prediction(view, narrow=True),
            prediction_in_words(view),
            _heading(view, drawn),
        )
        for view in drawn
        if view.torque_predicted_nm is not None
    ]


def _heading(view: RecordingView, drawn: Sequence[RecordingView]) -> str:
    role = " (validation: not seen by the estimate)" if view.validation else ""
    return view.signals.name + role if len(drawn) > 1 or role else ""


def _picture(wide: Figure, narrow: Figure, alt: str, heading: str = "") -> Picture:
    return Picture(data_uri(wide), data_uri(narrow), alt, heading)
