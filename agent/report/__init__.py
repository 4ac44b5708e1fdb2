"""Pictures and the offline report. Called from the top only.

Lives here: what is drawn and written for people. Does not live here: anything that is computed
from samples beyond what a picture needs; the estimate comes finished.
"""

from __future__ import annotations

from agent.report.estimate import estimate_html, write_estimate_report
from agent.report.figures.curve import figure_friction_curve
from agent.report.figures.cycle import figure_cycle
from agent.report.figures.prediction import figure_prediction
from agent.report.views import EstimateViews, RecordingView

__all__ = [
    "EstimateViews",
    "RecordingView",
    "estimate_html",
    "figure_cycle",
    "figure_friction_curve",
    "figure_prediction",
    "write_estimate_report",
]
