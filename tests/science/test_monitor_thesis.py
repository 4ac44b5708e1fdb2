"""The thesis's detector against its equations worked by hand, and its two case studies."""

from __future__ import annotations

import numpy as np
import pytest

from agent.monitor.detection.decision import decide
from agent.monitor.detection.series import FeatureSeries, State
from agent.monitor.detection.thesis import Thesis
from tests.benchmarks.monitor_case_study import COURSES, breakdown_share, normal_share
from tests.science.monitor_joint import DAY_S

NF, H0, H1 = State.NO_FAULT, State.INCREASED, State.HIGH


def series(**features: list[float]) -> FeatureSeries:
    values = {name: np.array(y) for name, y in features.items()}
    n = len(next(iter(values.values())))
    return FeatureSeries(
        DAY_S * np.arange(n, dtype=float), values, {k: 0.0 * v for k, v in values.items()}, 1
    )


def test_the_printed_equations_worked_by_hand() -> None:
    """lambda = 0.8: theta_0 = 0.8 y_{t-1} + 0.2 y_t, theta_t = 0.2 y_{t-1} + 0.8 y_t, v of (6.4).

    y = 10, 10, 12, 12:  theta_0 = 10, 10, 10.4, 12;  eps = 0, 0, 1.2, 0;
    sigma(eps_1..t) = 0, 0, sqrt(1.44/3 - 0.16), sqrt(1.44/4 - 0.09) = 0, 0, 0.56569, 0.51962;
    v = 0.01 theta_0 + 0.4 sigma = 0.1, 0.1, 0.33027, 0.32785.
    """
    trace = Thesis().trace(np.array([10.0, 10.0, 12.0, 12.0]))
    assert trace.threshold / 3.0 == pytest.approx([0.1, 0.1, 0.330274, 0.327846], abs=1e-6)
    first = 1.2 - 0.330274
    assert trace.statistic == pytest.approx([0.0, 0.0, first, first - 0.327846], abs=1e-6)


def test_a_crossing_sets_the_sum_to_zero_as_equation_6_1_says() -> None:
    """A jump of 10 makes eps = 6 and v = 0.12 + 0.4 sigma: far beyond 3 v, and gone after it."""
    y = np.array([10.0, 10.0, 10.0, 20.0, 20.0])
    sigma = np.sqrt(36.0 / 4.0 - 2.25)
    crossing = 6.0 - (0.12 + 0.4 * sigma)
    assert Thesis().trace(y).statistic[3:] == pytest.approx([crossing, 0.0])
    kept = Thesis(reset=False).trace(y).statistic
    assert kept[3] == pytest.approx(crossing)
    assert kept[4] == pytest.approx(crossing - 0.2 - 0.4 * np.sqrt(36.0 / 5.0 - 1.44))


def test_the_recursive_average_is_the_exponential_one() -> None:
    normal, actual = Thesis(recursive=True).averages(np.array([1.0, 2.0, 2.0]))
    assert normal == pytest.approx([1.0, 1.2, 1.36])
    assert actual == pytest.approx([1.0, 1.8, 1.96])


def test_two_sided_sees_a_fall_that_one_sided_does_not() -> None:
    y = np.array([10.0, 10.0, 10.0, 10.0, 4.0])
    one, two = Thesis().trace(y), Thesis(two_sided=True).trace(y)
    assert one.statistic[-1] == 0.0
    assert two.statistic[-1] > two.threshold[-1]


def test_the_decision_takes_two_cycles_for_h0_and_three_for_h1() -> None:
    def marks(text: str) -> np.ndarray:
        return np.array([c == "x" for c in text])

    low, whole, coulomb = marks(".xxxx.xx"), marks("..xxxxxx"), marks("....x..x")
    states = decide({"low_integral_w": low, "integral_w": whole, "coulomb_nm": coulomb})
    assert states == (NF, NF, H0, H0, H1, NF, NF, H1)
    without = decide({"low_integral_w": low, "integral_w": whole, "coulomb_nm": coulomb & False})
    assert without == (NF, NF, H0, H0, H0, NF, NF, H0)


def test_a_cycle_that_lacks_a_feature_changes_nothing() -> None:
    rng = np.random.default_rng(0)
    y = 10.0 + 0.1 * rng.standard_normal(12) + np.where(np.arange(12) > 8, 20.0, 0.0)
    whole = Thesis(recursive=True, reset=False)
    full = whole.judge(series(coulomb_nm=list(y), integral_w=list(y), low_integral_w=list(y)))
    gap = np.insert(y, 5, np.nan)
    other = whole.judge(
        series(coulomb_nm=list(gap), integral_w=list(gap), low_integral_w=list(gap))
    )
    assert H1 in full.states
    assert other.states == (*full.states[:5], full.states[4], *full.states[5:])
    with pytest.raises(ValueError, match="integral_w missing"):
        whole.judge(series(coulomb_nm=[1.0, 1.0], low_integral_w=[1.0, 1.0]))


def test_the_recursive_reading_does_what_the_thesis_describes_and_the_printed_one_cannot() -> None:
    """A slice of ``tests.benchmarks.monitor_case_study``."""
    recursive, printed = Thesis(recursive=True, reset=False), Thesis()
    quiet, crossing = normal_share(recursive, range(20))
    assert quiet == 1.0
    assert crossing >= 0.2
    for wear in COURSES[:3]:
        assert breakdown_share(recursive, wear, range(10))[1] == 1.0, wear
    assert breakdown_share(printed, COURSES[0], range(10)) == (1.0, 0.0)
