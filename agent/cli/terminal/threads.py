"""How many threads linear algebra may have: one, unless the user says otherwise.

The matrices of an estimate are small. Threads that wait for each other in them spin, which costs a
second core without ending sooner, and takes that core from a cycle or a page that runs beside it.
With one thread the last digits do not depend on the machine's number of cores either (decision
0027).
"""

from __future__ import annotations

import os

LINEAR_ALGEBRA = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
    "NUMBA_NUM_THREADS",
)
"""What the libraries read when they are loaded: OpenMP, OpenBLAS, MKL, Accelerate, numba."""


def keep_to_one_thread() -> None:
    """Ask for one thread where nothing was asked for; call it before NumPy is imported."""
    for name in LINEAR_ALGEBRA:
        os.environ.setdefault(name, "1")
