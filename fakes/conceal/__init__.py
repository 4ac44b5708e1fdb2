"""Recordings with concealed effects: robots, physics and drives of their own; sealed labels.

Import late: the physics is compiled, and numba is slow to load.
"""

from fakes.conceal.campaign import KINDS, SNRS, Order, Tally, cases, orders
from fakes.conceal.case import FIRST_SCORED_SEED, ConcealedCase, ConcealedRun, conceal
from fakes.conceal.concealment import UnreachableError
from fakes.conceal.label import SealBrokenError, canonical, open_label, seal
from fakes.conceal.library import EFFECTS, LOOK_ALIKES
from fakes.conceal.outsiders import OUTSIDERS
from fakes.conceal.writing import WrittenCase, write_case, write_csv

__all__ = [
    "EFFECTS",
    "FIRST_SCORED_SEED",
    "KINDS",
    "LOOK_ALIKES",
    "OUTSIDERS",
    "SNRS",
    "ConcealedCase",
    "ConcealedRun",
    "Order",
    "SealBrokenError",
    "Tally",
    "UnreachableError",
    "WrittenCase",
    "canonical",
    "cases",
    "conceal",
    "open_label",
    "orders",
    "seal",
    "write_case",
    "write_csv",
]
