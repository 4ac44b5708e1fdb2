"""What the noise floor makes of noise alone: ``python -m tests.benchmarks.floor [joints] [seed]``.

The torque noise of concealed joints, white and coloured, passes the comparison's band with no
model and no effect. In a perfect world its root mean square over the floor is one; beside it what
the floor would be if a parabola took of noise as much as its share of the independent samples.
"""

from __future__ import annotations

import sys

import numpy as np

from agent.explain.rows.floor import variance_about_trend
from agent.identify.signals.thinning import Part, Thinned
from fakes.conceal.measure import draw_noise
from fakes.conceal.robot import draw_robot

_RATE_HZ, _CUTOFF_HZ, _STRIDE, _WINDOW_S, _LONG_S = 500.0, 40.0, 4, 0.5, 600.0


def ratios(seed: int) -> tuple[float, float]:
    """Return a joint's noise in the band over the floor, and over that of a white world."""
    rng = np.random.default_rng(seed)
    sensing = draw_robot(rng, gravity=True, sample_rate_hz=_RATE_HZ).sensing
    torque = draw_noise(rng, sensing, round(_LONG_S * _RATE_HZ)).torque_nm
    whole = slice(0, torque.shape[0]), slice(0, -(-torque.shape[0] // _STRIDE))
    seen = Thinned([Part(*whole, 1.0 / _RATE_HZ, _CUTOFF_HZ, _STRIDE)])(torque[:, np.newaxis])[:, 0]
    length = round(_WINDOW_S * _RATE_HZ / _STRIDE)
    windows = seen[: seen.size // length * length].reshape(-1, length)
    independent = 2.0 * _CUTOFF_HZ * _WINDOW_S
    found = np.mean([variance_about_trend(w, independent) for w in windows])
    line = np.vander(np.linspace(-1.0, 1.0, length), 3)
    left = windows.T - line @ np.linalg.lstsq(line, windows.T)[0]
    white = np.mean(left**2) * independent / (independent - line.shape[1])
    size = float(np.mean(seen**2))
    return float(np.sqrt(size / found)), float(np.sqrt(size / white))


def main() -> None:
    """Print the median and the greatest of both."""
    joints = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    first = int(sys.argv[2]) if len(sys.argv) > 2 else 0
    found = np.array([ratios(seed) for seed in range(first, first + joints)])
    for name, values in zip(("floor", "floor of a white world"), found.T, strict=True):
        print(f"noise over the {name:<24} median {np.median(values):.3f}  most {values.max():.3f}")


if __name__ == "__main__":
    main()
