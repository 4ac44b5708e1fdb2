"""The monitor's figures: ``python -m tests.benchmarks.monitor``, or one ``--part`` of them.

Parts, each a table:

- ``fleet``: false alarms of healthy robots over a year after the baseline, 15 to 45 degC over the
  seasons, random payloads, bad and missing cycles; the whole chain, compensation included. An H0 is
  counted each time that it begins. Then the same robots with wear: how far low-speed friction had
  risen when the first alarm came. All detectors in one run, and a CUSUM of twenty lines without
  compensation.
- ``rate``: false alarms counted against those asked for, where nights are correlated.
- ``delay``: cycles until a step is found, against the optimum at the same false-alarm rate.
- ``change``: error of the change time, coverage of its interval and of the outlook's.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Sequence

import numpy as np

from agent.identify.result import Floats
from agent.monitor.cusum import Cusum
from agent.monitor.detectors import DETECTORS
from agent.monitor.series import FeatureSeries, State
from agent.monitor.tuning import Target
from tests.benchmarks.monitor_change import CASES, TIED, campaign
from tests.benchmarks.monitor_delay import false_rate, measure
from tests.science.monitor_fleet import Life, Nights, episodes, live, low_speed_share

ONSET = 30  # nights after the baseline
RATES_PER_YEAR = (0.05, 0.1, 0.3, 1.0)
WORN = 100
# Apart from those that were looked at while designing.
FIRST_SEED, WORN_SEED, CHANGE_SEED = 5_000, 200_000, 700_000
TWENTY_LINES = "20-line, not compensated"


def twenty_lines(series: FeatureSeries) -> Sequence[State]:
    """Return the states of a textbook CUSUM: mean and deviation of the baseline, k 0.5, h 5."""
    y = series.values["low_integral_w"]
    mean, deviation = np.mean(y[: series.healthy]), np.std(y[: series.healthy])
    g, states = 0.0, []
    for i, z in enumerate((y - mean) / deviation):
        g = max(0.0, g + z - 0.5) if i >= series.healthy else 0.0
        states.append(State.INCREASED if g > 5.0 else State.NO_FAULT)
    return states


def judges() -> dict[str, Callable[[FeatureSeries, FeatureSeries], Sequence[State]]]:
    """Return each detector's states from the compensated and the raw series of a robot."""

    def of(word: str) -> Callable[[FeatureSeries, FeatureSeries], Sequence[State]]:
        judge = DETECTORS[word]().judge
        return lambda compensated, _: judge(compensated).states

    return {word: of(word) for word in DETECTORS} | {TWENTY_LINES: lambda _, raw: twenty_lines(raw)}


def judged(nights: Nights, healthy: int | None) -> tuple[int, dict[str, Sequence[State]]]:
    """Return the baseline's length and the states that each detector gives a robot's nights."""
    compensated = nights.compensated(healthy)
    raw = nights.raw(compensated.healthy)
    return compensated.healthy, {name: f(compensated, raw) for name, f in judges().items()}


def fleet(robots: int, healthy: int | None) -> None:
    """Print false alarms and the rise at detection."""
    taken = healthy or 60
    life = Life(healthy=taken, nights=taken + 365)
    started = time.process_time()
    h0: dict[str, int] = dict.fromkeys(judges(), 0)
    alarmed, h1 = dict(h0), dict(h0)
    for seed in range(FIRST_SEED, FIRST_SEED + robots):
        for name, states in judged(live(life, seed), healthy)[1].items():
            h0[name] += episodes(states, State.INCREASED)
            alarmed[name] += any(s is not State.NO_FAULT for s in states)
            h1[name] += episodes(states, State.HIGH)
    spent = time.process_time() - started
    worn = wear_table(life, healthy)
    rule = "by the rule (8 to 60)" if healthy is None else f"{healthy} nights"
    print(f"\nfleet: {robots} healthy robot-years, baseline {rule}; {spent:.0f} s CPU")
    heads = " ".join(f"{100 * r:.0f} %/a".rjust(13) for r in RATES_PER_YEAR)
    print(f"{'':26s} {'H0/10 a':>8s} {'robots':>7s} {'H1/100 a':>8s}  rise found at, % {heads}")
    for name, times in h0.items():
        cells = " ".join(f"{m:6.1f} {q:6.1f}" for m, q in worn[name])
        print(
            f"{name:26s} {10 * times / robots:8.2f} {alarmed[name] / robots:7.1%} "
            f"{100 * h1[name] / robots:8.2f}  {'':16s} {cells}",
            flush=True,
        )
    print(
        "rise found at: median and 90 % quantile of the rise of low-speed friction; inf: not found"
    )


def wear_table(life: Life, healthy: int | None) -> dict[str, list[tuple[float, float]]]:
    """Return median and 90 % quantile of the rise in percent at the first alarm, by rate of wear.

    A robot that alarmed before the wear began is counted as of that moment: no rise.
    """
    share = low_speed_share(life.joint)
    out: dict[str, list[tuple[float, float]]] = {name: [] for name in judges()}
    start = life.healthy + ONSET
    for rate in RATES_PER_YEAR:
        found: dict[str, list[float]] = {name: [] for name in out}
        risen = rate / 365.0 * np.maximum(0.0, np.arange(life.nights) - start)
        for seed in range(WORN):
            nights = live(life, WORN_SEED + seed, risen / share)
            for name, states in judged(nights, healthy)[1].items():
                found[name].append(rise_found(states, nights.day, risen, start))
        for name, rises in found.items():
            median, most = np.quantile(rises, (0.5, 0.9), method="higher")
            out[name].append((100.0 * float(median), 100.0 * float(most)))
    return out


def rise_found(states: Sequence[State], day: Floats, risen: Floats, start: int) -> float:
    """Return the rise at the first alarm from the onset on, infinite if there is none."""
    for state, night in zip(states, day.astype(int).tolist(), strict=True):
        if state is not State.NO_FAULT and night >= start:
            return float(risen[night])
    return float("inf")


def rate(robots: int) -> None:
    """Print the false alarms of noise that were counted, one a year being asked for."""
    print("\nrate: false alarms a year from noise alone where 1 is asked for, noise 2 %, nightly")
    print("baseline  independent  neighbours tied 0.3  tied 0.6")
    asked = Cusum(Target(increased_per_year=2.0))
    for healthy in (15, 30, 60, 120):
        counted = [false_rate(asked, healthy, 0.02, robots, 1.0, m)[0] for m in (0.0, 0.3, 0.6)]
        print(f"{healthy:8d} {counted[0]:12.2f} {counted[1]:20.2f} {counted[2]:9.2f}", flush=True)


def delay(robots: int) -> None:
    """Print the delay table."""
    print("\ndelay: mean cycles to find a step that the detector is told to look for, nightly")
    print("baseline  noise   rise  false/a  found  optimum  ratio")
    for healthy in (30, 60, 120):
        for noise, rise in ((0.01, 0.03), (0.02, 0.03), (0.03, 0.03)):
            d = measure(healthy, noise, rise, robots=robots)
            print(
                f"{healthy:8d} {noise:6.1%} {rise:6.1%} {d.false_per_year:8.3f} {d.cycles:6.2f} "
                f"{d.optimum:8.2f} {d.ratio:6.2f}",
                flush=True,
            )


def change(seeds: int) -> None:
    """Print the change-time table."""
    print("\nchange: nightly, noise 1 %, outlook to a rise of 30 %")
    print(f"{'':36s} error covers  said nights single undecided outlooks cover")
    scores = []
    for course in CASES + TIED:
        s = campaign(course, range(CHANGE_SEED, CHANGE_SEED + seeds))
        scores.append(s)
        print(
            f"{course.name:36s} {s.median_error:5.1f} {s.coverage:6.1%} {s.stated:5.1%} "
            f"{s.nights:6.1f} {s.single:6.1%} {s.undecided:9.1%} "
            + (f"{s.outlooks:8.1%} {s.outlook_coverage:6.1%}" if s.outlooks else f"{'–':>8s}"),
            flush=True,
        )
    pooled = [float(np.mean([getattr(s, part) for s in scores])) for part in ("coverage", "stated")]
    print(f"{'all, in equal parts':36s} {'':5s} {pooled[0]:6.1%} {pooled[1]:5.1%}")


def main() -> None:
    """Print the tables that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--robots", type=int, default=1000)
    parser.add_argument("--baseline", type=int, default=60, help="nights; 0 lets the rule choose")
    parser.add_argument("--part", choices=("fleet", "rate", "delay", "change"))
    asked = parser.parse_args()
    if asked.part in (None, "fleet"):
        fleet(asked.robots, asked.baseline or None)
    if asked.part in (None, "rate"):
        rate(200)
    if asked.part in (None, "delay"):
        delay(200)
    if asked.part in (None, "change"):
        change(500)


if __name__ == "__main__":
    main()
