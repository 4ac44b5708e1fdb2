"""An observer of friction on ordinary motion: a Kalman filter with friction among its states.

The thesis (section 2.2.2) names observers as the residual generator that needs no special
excitation, and augmented states as the way to follow a parameter with one. The states are the
motor's position and velocity, and by how much friction lies above the healthy curve: at every speed
alike, and in proportion to speed. Both walk slowly. From block to block of ``T`` seconds, with the
recorded torque u as input,

``v+ = v + (1/J) int (u - g(q) - s F(|w|) - s c - b w / w_top) dt``

and the position with the same integrand's second integral, where w is the measured velocity, s its
sign and F the healthy friction curve: linear in the states, so that the filter is the exact one. A
block in which the joint stands or turns round says nothing of sliding friction: the motion is begun
anew after it.

What a model lacks colours the innovations (`whiteness`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from agent.identify.result import Floats
from agent.monitor.observer.model import Blocks, ObserverModel

_PRIOR = 0.3  # of the healthy friction: what is believed of c and b before the first block
_WALK_PER_S = 1e-3  # of the healthy friction, in a second's square root
_SETTLING = 10  # blocks after the start whose innovations are not judged


@dataclass(frozen=True)
class ObserverRun:
    """What the observer saw in one recording; arrays over n blocks.

    Parameters
    ----------
    time_s : ndarray, shape (n,)
    states : ndarray, shape (n, 4)
        Position, velocity, c and b, after each block.
    covariances : ndarray, shape (n, 4, 4)
    innovations : ndarray, shape (n, 2)
        Of position and velocity, whitened by their own covariance: independent with variance 1
        where the model is right. NaN where the motion was begun anew.
    """

    time_s: Floats
    states: Floats
    covariances: Floats
    innovations: Floats

    def judged(self) -> Floats:
        """Return the innovations without those of the first blocks, shape (m, 2)."""
        return self.innovations[_SETTLING:]

    def rise_nm(self, share_of_top: float) -> float:
        """Return the rise of friction at a share of the top speed at the end."""
        return float(self.states[-1] @ np.array([0.0, 0.0, 1.0, share_of_top]))


def observe(blocks: Blocks, model: ObserverModel) -> ObserverRun:
    """Run the filter over one recording.

    Parameters
    ----------
    blocks : Blocks
        From `blocks_of`.
    model : ObserverModel
        Of the healthy joint.
    """
    count = blocks.time_s.size
    noise = np.diag([model.position_sd_rad**2, model.velocity_sd_rad_s**2])
    state = np.zeros(4)
    covariance = np.zeros((4, 4))
    covariance[2:, 2:] = np.eye(2) * (_PRIOR * model.level_nm) ** 2
    states, covariances = np.empty((count, 4)), np.empty((count, 4, 4))
    innovations = np.full((count, 2), np.nan)
    for k in range(count):
        if blocks.starts[k]:
            _begin(state, covariance, blocks.before[k], noise)
        transition, step = _transition(blocks, k, model)
        state = transition @ state + step
        covariance = transition @ covariance @ transition.T + _walk(float(blocks.span_s[k]), model)
        if blocks.slides[k]:
            left = blocks.measured[k] - state[:2]
            spread = covariance[:2, :2] + noise
            innovations[k] = np.linalg.solve(np.linalg.cholesky(spread), left)
            gain = np.linalg.solve(spread, covariance[:2, :]).T
            keep = np.eye(4)
            keep[:, :2] -= gain
            state = state + gain @ left
            covariance = keep @ covariance @ keep.T + gain @ noise @ gain.T
        else:
            _begin(state, covariance, blocks.measured[k], noise)
        states[k], covariances[k] = state, covariance
    return ObserverRun(blocks.time_s, states, covariances, innovations)


def _begin(state: Floats, covariance: Floats, measured: Floats, noise: Floats) -> None:
    """Set position and velocity to what is measured; what is known of friction stays."""
    state[:2] = measured
    covariance[:2, :] = 0.0
    covariance[:, :2] = 0.0
    covariance[:2, :2] = noise


def _transition(blocks: Blocks, k: int, model: ObserverModel) -> tuple[Floats, Floats]:
    """Return the transition over block k, shape (4, 4), and what the input adds, shape (4,)."""
    once, twice = 1, 0  # rows of velocity and position
    transition = np.eye(4)
    transition[0, 1] = blocks.span_s[k]
    for row, integral in ((once, 0), (twice, 1)):
        transition[row, 2] = -blocks.coulomb[k, integral] / model.inertia_kg_m2
        transition[row, 3] = -blocks.viscous[k, integral] / model.inertia_kg_m2
    step = np.zeros(4)
    step[once] = blocks.push[k, 0] / model.inertia_kg_m2
    step[twice] = blocks.push[k, 1] / model.inertia_kg_m2
    return transition, step


def _walk(span_s: float, model: ObserverModel) -> Floats:
    """Return the covariance that a block adds, shape (4, 4)."""
    out = np.zeros((4, 4))
    density = model.torque_density_nm2_s / model.inertia_kg_m2**2
    out[:2, :2] = density * np.array(
        [[span_s**3 / 3.0, span_s**2 / 2.0], [span_s**2 / 2.0, span_s]]
    )
    out[2, 2] = out[3, 3] = span_s * (_WALK_PER_S * model.level_nm) ** 2
    return out
