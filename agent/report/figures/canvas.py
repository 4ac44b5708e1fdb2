"""How every picture looks, and how it becomes part of the page.

Matplotlib is imported late and used through its objects alone: no pyplot, so nothing is left
behind in a figure manager. The style is set for the time of drawing and put back after it.
"""

from __future__ import annotations

import base64
import functools
import io
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

import numpy as np

from agent.identify.result import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.typing import RcKeyType

# Okabe and Ito's palette, two of its colours darkened until a thin line has 3:1 on white.
INK = "#1c2733"
MUTED = "#5c6975"
GRID = "#e3e8ec"
SHADE = "#e8eff5"
NOISE = "#bcc7d1"
MEASURED_PALE = "#a6cbe5"
COMMAND_PALE = "#f3b57e"
MEASURED = "#0072b2"
PREDICTED = "#c45200"
POSITION = "#00795a"
TEMPERATURE = "#a0447c"
RIVALS = ("#00795a", "#a0447c", "#8a6d00", "#5c6975")

WIDE_IN = 9.6
NARROW_IN = 4.3
SVG_LIMIT_BYTES = 400_000
_PNG_DPI = 170
_LEFT_IN, _RIGHT_IN, _TITLE_IN, _YLABEL_IN = 0.7, 0.12, 0.28, 0.54
WITHOUT_LABELS_IN, WITH_LABELS_IN = 0.1, 0.52
KEY_IN = 0.22
"""A line for a key over a panel's title."""

_PAGE_FONTS = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', Arial, sans-serif"

_STYLE: dict[RcKeyType, Any] = {
    "font.family": "DejaVu Sans",  # comes with matplotlib: the layout is the same everywhere
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.titlecolor": INK,
    "axes.labelsize": 9.0,
    "axes.labelcolor": MUTED,
    "axes.edgecolor": "#b4bec7",
    "axes.linewidth": 0.8,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.unicode_minus": True,
    "axes.formatter.useoffset": False,
    "axes.formatter.limits": (-5, 6),
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.2,
    "lines.solid_joinstyle": "round",
    "text.color": INK,
    "text.usetex": False,
    "text.parse_math": False,  # names come from outside: a dollar sign is a dollar sign
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.major.size": 3.0,
    "ytick.major.size": 0.0,
    "xtick.minor.size": 0.0,
    "legend.frameon": False,
    "legend.fontsize": 9.0,
    "legend.handlelength": 1.4,
    "legend.borderaxespad": 0.0,
    "legend.columnspacing": 1.4,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "svg.fonttype": "none",  # text stays text, in the page's own type face
    "svg.hashsalt": "stribeck",  # ids do not differ from run to run
}


@dataclass(frozen=True)
class Panel:
    """A panel's height, and the space below it that its ticks and label need; inches."""

    height_in: float
    below_in: float


P = ParamSpec("P")
R = TypeVar("R")


def styled(draw: Callable[P, R]) -> Callable[P, R]:
    """Run `draw` under the house style; whatever the caller had set is back afterwards."""

    @functools.wraps(draw)
    def drawn(*args: P.args, **kwargs: P.kwargs) -> R:
        import matplotlib as mpl

        with mpl.rc_context(_STYLE):
            return draw(*args, **kwargs)

    return drawn


def stacked(panels: Sequence[Panel], *, narrow: bool, header_in: float = 0.0) -> list[Axes]:
    """Return axes below each other, placed in inches: as wide as the page's column or a phone.

    Margins are fixed rather than measured: that draws three times as fast as a layout engine, and
    panels of different pictures stand exactly below each other on the page.

    Parameters
    ----------
    panels : sequence of Panel
        From top to bottom.
    narrow : bool
        For a phone's width.
    header_in : float
        Space above the first panel, besides its title.
    """
    from matplotlib.figure import Figure

    width = NARROW_IN if narrow else WIDE_IN
    height = header_in + sum(_TITLE_IN + panel.height_in + panel.below_in for panel in panels)
    figure = Figure(figsize=(width, height))
    made = []
    top = height - header_in
    for panel in panels:
        bottom = top - _TITLE_IN - panel.height_in
        made.append(_axes(figure, (_LEFT_IN, bottom), (width - _RIGHT_IN, top - _TITLE_IN)))
        top = bottom - panel.below_in
    return made


def side_by_side(height_in: float, *, header_in: float = 0.0) -> list[Axes]:
    """Return two axes of equal size beside each other, as wide as the page's column."""
    from matplotlib.figure import Figure

    height = header_in + _TITLE_IN + height_in + WITH_LABELS_IN
    figure = Figure(figsize=(WIDE_IN, height))
    top = height - header_in - _TITLE_IN
    return [
        _axes(figure, (start + _LEFT_IN, top - height_in), (start + WIDE_IN / 2 - _RIGHT_IN, top))
        for start in (0.0, WIDE_IN / 2)
    ]


def figure_of(axes: Axes) -> Figure:
    """Return the figure that `stacked` or `side_by_side` made around these axes."""
    from matplotlib.figure import Figure

    figure = axes.get_figure(root=True)
    assert isinstance(figure, Figure)
    return figure


def _axes(
    figure: Figure, lower_left: tuple[float, float], upper_right: tuple[float, float]
) -> Axes:
    """Add axes between two corners given in inches; all ordinates' labels stand in one line."""
    width, height = figure.get_size_inches()
    (left, bottom), (right, top) = lower_left, upper_right
    rectangle = (left / width, bottom / height, (right - left) / width, (top - bottom) / height)
    axes = figure.add_axes(rectangle)
    axes.yaxis.set_label_coords(-_YLABEL_IN / (right - left), 0.5)
    return axes


def key_in_header(axes: Axes, *, columns: int, over_title: bool = False) -> None:
    """Put the key to the lines above the panel, right-aligned, where it covers no data.

    `over_title` puts it a line higher, where a phone's width has no room beside the title; that
    line is the caller's to leave free (`KEY_IN`).
    """
    height_in = axes.get_position().height * figure_of(axes).get_figheight()
    lift = _TITLE_IN / height_in if over_title else 0.01
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0 + lift), ncols=columns)


def plain_ticks(axes: Axes) -> None:
    """Write 1, 2, 5, 10 on a logarithmic axis rather than powers of ten."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    low, high = axes.get_xlim()
    steps: tuple[float, ...] = (1.0, 2.0, 5.0)
    if high / low > 300.0:
        steps = (1.0,)
    elif high / low < 8.0:
        steps = (1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0)
    axes.xaxis.set_major_locator(LogLocator(subs=steps))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())


def dots(axes: Axes, x: Floats, y: Floats, *, color: str, size_pt: float, alpha: float) -> None:
    """Draw many dots as one path: a tenth of the bytes that as many markers take.

    A dot is a line of no length with round ends.
    """
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    vertices = np.repeat(np.column_stack((x, y)), 2, axis=0)
    path = Path(vertices, np.tile([Path.MOVETO, Path.LINETO], x.size))
    path.should_simplify = False  # it would take lines of no length for superfluous
    axes.add_patch(PathPatch(path, fill=False, ec=color, lw=size_pt, alpha=alpha, capstyle="round"))
    axes.autoscale_view()


def bins_for(figure: Figure) -> int:
    """Return the stretches that a line needs in this figure: some 50 to the inch."""
    return int(50 * figure.get_figwidth())


def data_uri(figure: Figure, *, svg_limit_bytes: int = SVG_LIMIT_BYTES) -> str:
    """Return the figure as a ``data:`` address: SVG, or PNG where SVG would be too large.

    The same figure gives the same bytes: no date, no random ids.
    """
    svg = _svg(figure)
    if len(svg) <= svg_limit_bytes:
        return "data:image/svg+xml;base64," + base64.b64encode(svg).decode("ascii")
    return "data:image/png;base64," + base64.b64encode(_png(figure)).decode("ascii")


@styled
def _svg(figure: Figure) -> bytes:
    buffer = io.BytesIO()
    no_metadata = dict.fromkeys(("Creator", "Date", "Format", "Type"))
    figure.savefig(buffer, format="svg", metadata=no_metadata)
    text = buffer.getvalue().decode("utf-8")
    text = re.sub(r'(?<= d=")[^"]*', lambda path: _shorter(path[0]), text)
    text = text.replace("'DejaVu Sans'", _PAGE_FONTS)
    return text.encode("utf-8")


def _shorter(path: str) -> str:
    """Write a path's coordinates to a hundredth of a point, finer than any screen."""
    rounded = re.sub(r"(\.\d\d)\d+", r"\1", path)
    return re.sub(r"\s*([A-Za-z])\s*", r"\1", rounded)


@styled
def _png(figure: Figure) -> bytes:
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=_PNG_DPI, metadata={"Software": None})
    return buffer.getvalue()
