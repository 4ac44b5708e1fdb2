"""Recordings with concealed effects: robots, physics and drives of their own; sealed labels.

Import late: the physics is compiled, and numba is slow to load.
"""

from fakes.conceal.case import FIRST_SCORED_SEED, ConcealedCase, ConcealedRun, conceal
from fakes.conceal.concealment import UnreachableError
from fakes.conceal.label import SealBrokenError, canonical, open_label, seal
from fakes.conceal.library import EFFECTS, LOOK_ALIKES
from fakes.conceal.outsiders import OUTSIDERS
from fakes.conceal.writing import WrittenCase, write_case, write_csv

__all__ = [
    "EFFECTS",
    "FIRST_SCORED_SEED",
    "LOOK_ALIKES",
    "OUTSIDERS",
    "ConcealedCase",
    "ConcealedRun",
    "SealBrokenError",
    "UnreachableError",
    "WrittenCase",
    "canonical",
    "conceal",
    "open_label",
    "seal",
    "write_case",
    "write_csv",
]
