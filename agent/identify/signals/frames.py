"""What speaks against a recording because of samples that it lacks.

Lost samples do harm in two ways. Lost at random they only thin the data: a gap cuts the recording
into stretches, and nothing is filtered across it. But a cable that breaks contact at one angle, or
a drive that is too busy to answer at high speed, loses samples *because* of what is measured. The
mean over a steady window of n samples with spread s is then off by at most some ``3 p s``, when a
share p of them is lost at the worst end; its own 95 % interval is ``2 s / sqrt(n)``. With
``p = TOLERATED = 1 %`` the first stays below the second up to n = 4400, more than a window holds
(4 s at 1 kHz). Beyond that share the interval could be wrong, and nobody could see it.

Frames that the kernel dropped have a known cause: this computer had no room for them. They come in
bursts that the joint does not choose, so they count as gaps and not against the tolerance. Rows
that are missing without being in the account at all have no cause that anybody knows; up to one in
a thousand, or three, they are borne.

Rows that may stand in another's place in time are doubtful. Where the account says when, they are
left out, and so they are lost: most often to a computer that stood still, which the joint does not
choose, but a drive that is too busy at high speed answers late, too, and shows it only while it
moves. So they count against the tolerance. Where nobody says which they are (recordings of earlier
versions) up to one in a thousand, or three, are borne: at a steady speed such a row has its
neighbour's torque, and so few change no fit.
"""

from __future__ import annotations

import numpy as np

from agent.identify.signals.preprocess import Motion

TOLERATED = 0.01
"""Share of the samples asked for that may be lost without a known cause."""

_UNCOUNTED = 0.001
_UNCOUNTED_LEAST = 3


def objections_of_frames(motion: Motion) -> list[str]:
    """Return why the samples that a recording lacks forbid an estimate; empty where they do not."""
    signals, account = motion.signals, motion.signals.acquisition
    if account is not None and account.changed:
        return [
            f"{signals.name}: when the cycle had ended, the drive was no longer set as at its "
            f"beginning ({account.changed[0]}): nobody can tell what its samples are"
        ]
    asked = signals.time_s.shape[0] + signals.samples_lost
    lost, left_out = signals.samples_lost, signals.left_out
    if account is not None:
        asked, lost = max(account.expected, 1), account.lost_unexplained
    if lost + left_out > TOLERATED * asked:
        late = f", and {left_out} may stand in another's place in time" if left_out else ""
        return [
            f"{signals.name}: {lost} of {asked} samples that were asked for never came{late} "
            f"({100.0 * (lost + left_out) / asked:.2g} %; up to {100.0 * TOLERATED:g} % can be "
            "borne); too many frames lost without a known cause"
        ]
    if account is None:
        return []
    located = account.doubtful_s is not None
    if not located and account.doubtful > max(_UNCOUNTED_LEAST, _UNCOUNTED * asked):
        return [
            f"{signals.name}: {account.doubtful} of {account.received} samples may stand in their "
            "neighbour's place in time: answers came late by whole periods and were taken for lost"
        ]
    missing = missing_rows(motion)
    known = account.lost + account.not_asked
    if missing > known + max(_UNCOUNTED_LEAST, _UNCOUNTED * asked):
        return [
            f"{signals.name}: {missing} samples are missing between its rows, but its account of "
            f"frames knows of {account.lost} lost and {account.not_asked} never asked for: the "
            "loss is unexplained"
        ]
    return []


def missing_rows(motion: Motion) -> int:
    """Return how many samples are missing between a recording's rows, by its median period."""
    step_s = np.diff(motion.signals.time_s)
    period_s = float(np.median(step_s))
    wide = step_s[step_s > 1.5 * period_s]
    return int(np.sum(np.round(wide / period_s) - 1.0))
