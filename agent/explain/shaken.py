"""What shakes a joint that looks as if a channel were late: at which frequency, and what tells.

The law that would carry most of such a mismatch is refused (`choosing.only_fast`), and the answer
has no name. What the refusal knows is said instead.
"""

from __future__ import annotations

import numpy as np

from agent.explain.choosing.candidate import basis_of, gain_of
from agent.explain.choosing.materiality import FAR
from agent.explain.choosing.only_fast import is_only_fast
from agent.explain.choosing.weighted import DELAY
from agent.explain.forms.library import FORMS
from agent.explain.rows.slow_motion import SLOW
from agent.explain.rows.table import Table
from agent.explain.study import Study
from agent.identify.result import Floats

_MOST = 0.3  # of what is left: a late channel that would carry so much is what one looks for
_WIDE_HZ = 2.0  # over which power is averaged


def shaken_said(found: Study) -> str:
    """Return what shakes the joint where a late channel would carry much of what is left.

    Parameters
    ----------
    found : Study
        As it is told.

    Returns
    -------
    str
        Empty where no such channel would, or slow motion is as late.
    """
    library, named = found.library, found.choice.candidates
    if found.left.ratio <= FAR or any(term.form.effect == DELAY for term in named):
        return ""
    form = next(form for form in FORMS if form.effect == DELAY)
    basis, left = basis_of(library.model(named)), library.residual(named)
    late = max(library.all_points(form), key=lambda each: gain_of(each, basis, left))
    share = gain_of(late, basis, left) / float(left @ left)
    if share < _MOST or not is_only_fast(library, late, named):
        return ""
    return (
        f"a channel that is late would carry {100.0 * share:.0f} % of what is left, but slow "
        f"motion is on time: something shakes the joint around {_shaken_hz(found):.2g} Hz, and the "
        "drive answers it later"
    )


def _shaken_hz(found: Study) -> float:
    """Return the frequency above slow motion around which most of what is left lies."""
    table, rows = found.table, found.library.weighing.rows
    left = np.zeros(table.used.shape[0])
    left[rows] = found.model.residual_nm
    hertz = np.arange(SLOW * table.cutoff_hz, table.cutoff_hz, 0.25 * _WIDE_HZ)
    return float(hertz[int(np.argmax(_power(table, left, hertz)))])


def _power(table: Table, left: Floats, hertz: Floats) -> Floats:
    """Return the energy within a few hertz of some frequencies, shape (f,)."""
    out = np.zeros(hertz.shape[0])
    for piece in table.pieces:
        own = left[piece.rows]
        at = np.fft.rfftfreq(own.shape[0], piece.period_s * piece.stride)
        below = np.concatenate(([0.0], np.cumsum(np.abs(np.fft.rfft(own)) ** 2) / own.shape[0]))
        ends = (hertz - 0.5 * _WIDE_HZ, hertz + 0.5 * _WIDE_HZ)
        low, high = (below[np.searchsorted(at, end)] for end in ends)
        out += high - low
    return out
