"""Whether a stair of 20 s tells every number as well as thesis 4.1.1 does in 40 s.

``python -m tests.benchmarks.design_reach [cycles]``. By the expected covariance: the thesis's
standard error of every number over that of the stair that the product designs, whose criterion is
the determinant, and over that of the stair whose worst number is the best. The latter may hold
speeds in any order, slow ones also in the middle of a stroke and more than once; it is sought by
annealing (Kirkpatrick, Gelatt and Vecchi 1983). Then simulated cycles of it and of the thesis's.
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from tests.benchmarks.design import rms
from tests.science.design_cycles import (
    ACCELERATION_RAD_S2,
    BODY,
    JERK_RAD_S3,
    LAW,
    STROKE_RAD,
    Floats,
    Truth,
    belief,
    designed,
    found,
    noise,
    request,
    thesis_stair,
)
from trajectories import DesignRequest, Trajectory, expect
from trajectories.design_information import (
    BODY_PARAMETERS,
    NORMAL_975,
    friction_information,
    usable_s,
)
from trajectories.design_layout import Layout, Room, held_in
from trajectories.design_search import GRID_RATIO

CYCLES, SECONDS = 200, 20.0
BEGINNINGS, STEPS = 40, 4000
HOT, COLD = 0.1, 1e-4  # of a logarithm
Strokes = tuple[tuple[tuple[int, float], ...], ...]
"""For every stroke the numbers of its speeds in the grid, each with its share of the time."""


@dataclass(frozen=True)
class Aim:
    """What is sought: `theirs` are the standard errors to be reached, by name."""

    room: Room
    asked: DesignRequest
    grid_rad_s: Floats
    theirs: dict[str, float]

    @cached_property
    def columns(self) -> Floats:
        """Scaled sensitivities of the nominal joint on the grid, shape (1, g, p)."""
        return self.asked.belief.columns(self.grid_rad_s)[:1]

    def layout(self, strokes: Strokes) -> Layout | None:
        """Return the stair, or None where there is no room for it."""
        if any(a[0] == b[0] for s in strokes for a, b in pairwise(s)):
            return None  # one speed, held twice without a ramp between
        groups = [[(float(self.grid_rad_s[i]), share) for i, share in s] for s in strokes]
        return held_in(groups, self.room)

    def gains(self, strokes: Strokes) -> dict[str, float] | None:
        """Return their standard error over that of these strokes, for every number."""
        layout, joint = self.layout(strokes), self.asked.belief
        if layout is None:
            return None
        seen_s: dict[int, float] = {}
        held = zip((i for s in strokes for i, _ in s), layout.dwells_s.tolist(), strict=True)
        for i, dwell_s in held:
            seen_s[i] = seen_s.get(i, 0.0) + float(usable_s(dwell_s, self.asked.settle_s))
        picks = sorted(seen_s)
        if len(picks) < self.asked.speeds_min or min(seen_s.values()) <= 0.0:
            return None
        density = self.asked.noise.density_nm2_s
        variance = 0.5 * density / np.array([seen_s[i] for i in picks])
        friction = friction_information(self.columns[:, picks], variance)[0]
        body = layout.body_gram(self.room, -STROKE_RAD, 1.0, joint.gear_ratio) / density
        errors = (
            np.sqrt(np.diag(np.linalg.pinv(friction, hermitian=True))) * joint.friction_scales,
            np.sqrt(np.diag(np.linalg.inv(body))),
        )
        names = (*joint.friction_names, *BODY_PARAMETERS)
        both = zip(names, np.concatenate(errors).tolist(), strict=True)
        return {name: self.theirs[name] / error for name, error in both}

    def worst(self, strokes: Strokes) -> float:
        """Return the logarithm of the worst gain; minus infinity where there is no room."""
        gains = self.gains(strokes)
        return -math.inf if gains is None else math.log(min(gains.values()))


def aim() -> Aim:
    """Return the stroke, speeds and ramps that the thesis's stairs and the designed one have."""
    asked, theirs = request(SECONDS), expect(thesis_stair(), belief(), noise()).half_widths
    slowest, fastest = asked.speed_min_rad_s, asked.speed_max_rad_s
    room = Room(
        2.0 * STROKE_RAD,
        SECONDS,
        ACCELERATION_RAD_S2,
        JERK_RAD_S3,
        asked.dwell_min_s,
        asked.rest_s,
    )
    count = 1 + math.floor(math.log(fastest / slowest) / math.log(GRID_RATIO))
    errors = {name: half / NORMAL_975 for name, half in theirs.items()}
    return Aim(room, asked, np.geomspace(slowest, fastest, count), errors)


def annealed(sought: Aim) -> Strokes:
    """Return the strokes whose worst number is the best, of several beginnings."""
    rng = np.random.default_rng(0)
    best: tuple[float, Strokes] = (-math.inf, ())
    for _ in range(BEGINNINGS):
        at = _beginning(sought, rng)
        value = sought.worst(at)
        for k in range(STEPS):
            trial = _changed(at, sought.grid_rad_s.size, rng)
            worth = sought.worst(trial)
            heat = max(HOT * (1.0 - k / STEPS), COLD)
            if worth >= value or rng.random() < math.exp(max((worth - value) / heat, -700.0)):
                at, value = trial, worth
            best = max(best, (value, at), key=lambda pair: pair[0])
    return best[1]


def _beginning(sought: Aim, rng: np.random.Generator) -> Strokes:
    """Return strokes that there is room for: drawn until there is."""
    while True:
        count = int(rng.integers(8, 12))
        picks = rng.choice(sought.grid_rad_s.size, count).tolist()
        held = tuple((int(i), float(np.exp(rng.normal(0.0, 0.5)))) for i in picks)
        cut = int(rng.integers(1, count))
        strokes: Strokes = (held[:cut], held[cut:]) if rng.random() < 0.5 else (held,)
        if sought.worst(strokes) > -math.inf:
            return strokes


def _changed(strokes: Strokes, size: int, rng: np.random.Generator) -> Strokes:
    """Return strokes in which one speed is another, held longer, moved, doubled or left out."""
    out = [list(s) for s in strokes]
    own = out[int(rng.integers(len(out)))]
    j, what = int(rng.integers(len(own))), rng.random()
    pick, share = own[j]
    if what < 0.3:
        own[j] = (int(np.clip(pick + rng.integers(-4, 5), 0, size - 1)), share)
    elif what < 0.7:
        own[j] = (pick, share * math.exp(rng.normal(0.0, 0.3)))
    elif what < 0.94:
        held = own.pop(j)
        other = out[int(rng.integers(len(out)))]
        other.insert(int(rng.integers(len(other) + 1)), held)
    elif what < 0.97:
        own.insert(j, (pick, share))
    else:
        own.pop(j)
    return tuple(tuple(s) for s in out)


def main(cycles: int) -> None:
    """Print both stairs' gains, the second one's strokes, and what cycles of it and theirs say."""
    sought = aim()
    strokes = annealed(sought)
    layout, gains = sought.layout(strokes), sought.gains(strokes)
    assert layout is not None
    assert gains is not None
    ours = designed(SECONDS).expectation.half_widths
    theirs = expect(thesis_stair(), belief(), noise()).half_widths
    print("standard error of thesis 4.1.1 (40 s) over that of a stair of 20 s, expected")
    print(f"  {'':<26}as designed   worst number best")
    for name, gain in gains.items():
        print(f"  {name:<26}{theirs[name] / ours[name]:11.2f}{gain:20.3f}")
    for stroke in layout.strokes:
        held = zip(stroke.speeds_rad_s, stroke.dwells_s, strict=True)
        print("  " + ", ".join(f"{v:.3g} rad/s for {d:.2f} s" for v, d in held))
    segments = layout.segments(sought.room, 1.0)
    stair = Trajectory("worst number best", {}, -STROKE_RAD, segments)
    runs = {
        name: [found(one, Truth(), seed) for seed in range(cycles)]
        for name, one in (("thesis", thesis_stair()), ("stair", stair))
    }
    print(f"the same of root mean square errors, {cycles} cycles each, {stair.duration_s:.1f} s")
    for name in (*LAW, *BODY):
        print(f"  {name:<26}{rms(runs['thesis'], name) / rms(runs['stair'], name):11.2f}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else CYCLES)
