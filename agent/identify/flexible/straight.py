"""Coordinates in which the valley of a chain of two masses runs straight.

A recording tells where a chain swings to a ten-thousandth, and, where it hardly excites the second
mode, what its masses and springs are to a tenth. In these the sum of squares is a valley that
bends: a straight step along it leaves it by many times its width. Its modes against a held motor,
two frequencies and how the inertia is shared between them, are what is told; a step in these stays
in the valley. Dampers keep their own coordinates.
"""

from __future__ import annotations

import math

import numpy as np

from agent.identify.flexible.chain import SHAPE_SIZE
from agent.identify.result import Floats

_CHAIN = SHAPE_SIZE["three-mass"]
_LEAST = 1e-12  # of the inertia, in a mode
_STEP = 1e-6


def stepped(kind: str | None, search: Floats, step: Floats) -> Floats:
    """Return searched parameters after a step of the straight coordinates.

    Parameters
    ----------
    kind : str or None
        Of the problem: for all but three masses the coordinates are the parameters themselves.
    search : ndarray, shape (s,)
    step : ndarray, shape (s,)
    """
    if kind != "three-mass":
        return search + step
    out = search + step
    out[:_CHAIN] = _shape(_modal(search[:_CHAIN]) + step[:_CHAIN])
    return out


def bend_of(kind: str | None, search: Floats) -> Floats:
    """Return the derivative of searched parameters by the straight coordinates, shape (s, s)."""
    out = np.eye(search.shape[0])
    if kind == "three-mass":
        at, steps = _modal(search[:_CHAIN]), _STEP * np.eye(_CHAIN)
        sides = [(_shape(at + h), _shape(at - h)) for h in steps]
        out[:_CHAIN, :_CHAIN] = np.stack([(a - b) / (2.0 * _STEP) for a, b in sides], axis=-1)
    return out


def _modal(shape: Floats) -> Floats:
    """Return ``ln omega`` of both modes, the dampers' own, and the logit of the first one's share.

    Of the chain's inertia: the part that swings in a mode when the motor shakes it.
    """
    nearest = 1.0 / (1.0 + math.exp(-float(shape[4])))
    inertias = np.maximum([nearest, 1.0 - nearest], _LEAST)
    near, far = (inertias * np.exp(2.0 * shape[:4:2])).tolist()
    stiffness = np.array([[near + far, -far], [-far, far]])
    root = np.sqrt(inertias)
    squares, modes = np.linalg.eigh(stiffness / np.outer(root, root))
    shares = np.maximum((modes.T @ root) ** 2, _LEAST)
    low, high = 0.5 * np.log(np.maximum(squares, 1e-300))
    return np.array([low, shape[1], high, shape[3], math.log(shares[0] / shares[1])])


def _shape(modal: Floats) -> Floats:
    """Return the shape parameters of a chain with these modes: the inverse of `_modal`.

    By the moments ``mu_n = sum M_i w_i^(2n)`` of the modes' shares: ``k1/J1 = mu_2/mu_1``,
    ``k2/J2 = w_1^2 w_2^2 mu_1/mu_2``, ``J1/J2 = mu_1^2/(M_1 M_2 (w_2^2 - w_1^2)^2)``.
    """
    first = 1.0 / (1.0 + math.exp(-float(modal[4])))
    shares = np.maximum([first, 1.0 - first], _LEAST)
    squares = np.exp(2.0 * modal[:4:2])
    one, two = float(shares @ squares), float(shares @ squares**2)
    apart = float(np.prod(shares)) * float(squares[1] - squares[0]) ** 2
    return np.array(
        [
            0.5 * math.log(two / one),
            modal[1],
            0.5 * math.log(float(np.prod(squares)) * one / two),
            modal[3],
            math.log(one * one / max(apart, _LEAST * one * one)),
        ]
    )
