"""Ripple from an independent simulator, whose truth is known."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from agent.identify.ripple.change import DOWN, GONE, HIDDEN, UP, compare_ripple
from agent.identify.ripple.identification import find_ripple, passes_of
from agent.identify.ripple.line import FRICTION, RIPPLE, UNDECIDED, stutter_chances
from agent.identify.ripple.order_spectrum import AnglePass, grid_for
from agent.identify.ripple.sentence import motion_sentence
from agent.identify.signals.arrays import Signals
from tests.science.ripple_campaign import CASES, Passes, ripple_campaign

TAU = 2.0 * np.pi
GEAR = 50.0


def passes(
    seed: int,
    ripple: dict[float, float],
    *,
    modulated: dict[float, float] | None = None,
    velocities: tuple[float, ...] = (3.0, -3.0, 4.5, -4.5),
    seconds: float = 8.0,
    position: bool = True,
    noise: float = 0.01,
) -> Signals:
    """Simulate passes with a pause between them and exponentially correlated noise."""
    rng = np.random.default_rng(seed)
    dt = 0.004
    velocity = np.concatenate(
        [np.concatenate((np.full(int(seconds / dt), v), np.zeros(250))) for v in velocities]
    )
    angle = np.cumsum(velocity) * dt
    white = rng.normal(size=velocity.size) * noise
    coloured = np.empty_like(white)
    state = 0.0
    for i, w in enumerate(white):
        state = 0.9 * state + np.sqrt(1.0 - 0.81) * w
        coloured[i] = state
    torque = 0.4 * np.sign(velocity) + 0.01 * velocity + coloured + 0.2 * np.sin(angle / GEAR)
    for order, size in ripple.items():
        torque += size * np.cos(order * angle + 0.7 * order)
    for order, size in (modulated or {}).items():
        torque += size * np.sign(velocity) * np.cos(order * angle + 0.3)
    columns = {
        "time_s": np.arange(velocity.size) * dt,
        "torque_nm": torque,
        "velocity_rad_s": velocity + 1e-4 * rng.normal(size=velocity.size),
    }
    if position:
        columns["position_rad"] = angle
    return Signals.from_columns(columns, GEAR, name="simulated")


def test_orders_and_amplitudes_whole_or_not() -> None:
    truth = {6.0: 0.05, 12.0: 0.02, 7.37: 0.03}
    found = find_ripple([passes(1, truth)])
    assert len(found.lines) == len(truth)
    for order, size in truth.items():
        line = found.at(order)
        assert line is not None
        assert line.kind == RIPPLE
        assert line.order_per_motor_rev.value == pytest.approx(order, abs=0.01)
        assert line.order_per_arm_rev.value == pytest.approx(order * GEAR, abs=0.5)
        assert line.amplitude_nm.value == pytest.approx(size, rel=0.05)


def test_neighbours_that_are_averaged_take_nothing_from_a_high_order() -> None:
    # 19 Hz at 4 kHz, 16 turns: 39 samples are one mean, of which order 30 had lost 8 %.
    turns, rate_hz, amplitude = 16.0, 4000.0, {24.0: 0.02, 30.0: 0.01}
    speed = TAU * 19.0 / 24.0
    count = int(turns * TAU / speed * rate_hz)
    velocity = np.concatenate(
        [np.append(np.full(count, v), np.zeros(2000)) for v in (speed, -speed)]
    )
    angle = np.cumsum(velocity) / rate_hz
    noise = 0.005 * np.random.default_rng(460_000).standard_normal(angle.size)
    torque = 0.4 * np.sign(velocity) + noise
    torque += sum(size * np.cos(k * angle + 0.3) for k, size in amplitude.items())
    columns = {
        "time_s": np.arange(angle.size) / rate_hz,
        "torque_nm": torque,
        "position_rad": angle,
    }
    found = find_ripple([Signals.from_columns(columns, GEAR, name="fast samples")])
    for order, size in amplitude.items():
        line = found.at(order)
        assert line is not None
        assert line.amplitude_nm.ci95 is not None
        low, high = line.amplitude_nm.ci95
        assert low <= size <= high
        assert high - low < 0.02 * size


def test_friction_along_the_position_is_told_from_ripple() -> None:
    found = find_ripple([passes(2, {6.0: 0.04}, modulated={9.0: 0.03})])
    ripple, friction = found.at(6.0), found.at(9.0)
    assert ripple is not None
    assert friction is not None
    assert ripple.kind == RIPPLE
    assert friction.kind == FRICTION


def test_one_direction_leaves_the_kind_open() -> None:
    line = find_ripple([passes(3, {6.0: 0.04}, velocities=(3.0, 3.0))]).at(6.0)
    assert line is not None
    assert line.kind == UNDECIDED
    assert "backwards" in line.reason


def test_without_position_the_orders_are_found_all_the_same() -> None:
    found = find_ripple([passes(4, {6.0: 0.04}, position=False)])
    line = found.at(6.0)
    assert line is not None
    assert line.amplitude_nm.value == pytest.approx(0.04, rel=0.1)
    assert any("integral of the velocity" in note for note in found.notes)


def test_coloured_noise_alone_names_nothing() -> None:
    false = sum(len(find_ripple([passes(100 + s, {}, noise=0.05)]).lines) for s in range(8))
    assert false <= 1


@pytest.mark.parametrize("case", CASES[2:3], ids=lambda c: c.name)
def test_amplitudes_are_near_the_bound_and_their_intervals_hold(case: Passes) -> None:
    """A slice of ``tests.benchmarks.ripple``, with room for the chance of few seeds."""
    scores, false = ripple_campaign(range(16), case)
    assert false <= 2
    for s in scores:
        assert s.coverage >= 0.75, s
        assert s.ratio <= 1.5, s


def test_passes_that_differ_widen_the_interval() -> None:
    """Ripple that grows between passes of one direction has no amplitude to a part in a hundred."""
    alike = find_ripple([passes(7, {6.0: 0.04}), passes(8, {6.0: 0.04})]).at(6.0)
    unlike = find_ripple([passes(7, {6.0: 0.03}), passes(8, {6.0: 0.05})]).at(6.0)
    assert alike is not None
    assert unlike is not None
    assert alike.amplitude_nm.ci95 is not None
    assert unlike.amplitude_nm.ci95 is not None
    assert np.ptp(unlike.amplitude_nm.ci95) > 3.0 * np.ptp(alike.amplitude_nm.ci95)
    assert unlike.amplitude_nm.ci95[0] < 0.04 < unlike.amplitude_nm.ci95[1]


def stuttering(seed: int, stutter_rad: float, order: float = 6.0) -> Signals:
    """Let the position stutter about its straight line, at one order, with ripple in the torque."""
    signals = passes(seed, {order: 0.04}, velocities=(3.0, -3.0))
    assert signals.position_rad is not None
    moved = signals.position_rad + stutter_rad * np.sin(order * signals.position_rad)
    return dataclasses.replace(signals, position_rad=moved)


def test_stutter_is_measured_at_the_orders_of_the_torque() -> None:
    line = find_ripple([stuttering(5, 0.01)], highest_order=40.0).at(6.0)
    assert line is not None
    assert line.stutter_rad.value == pytest.approx(0.01, rel=0.03)
    unseen = find_ripple([passes(4, {6.0: 0.04}, position=False)]).at(6.0)
    assert unseen is not None
    assert not unseen.stutter_rad.identified


def test_anticogging_is_told_by_the_motion_where_the_torque_stays() -> None:
    changes = compare_ripple([stuttering(5, 0.01)], [stuttering(6, 0.001)], 40.0)
    assert len(changes) == 1
    order = changes[0].at(6.0)
    assert order is not None
    assert order.torque_left.value == pytest.approx(1.0, abs=0.1)
    assert order.stutter_left.value == pytest.approx(0.1, abs=0.02)
    assert order.stutter_left.ci95 is not None
    assert order.stutter_left.ci95[0] < 0.1 < order.stutter_left.ci95[1]
    assert (
        compare_ripple([stuttering(5, 0.01)], [passes(6, {6.0: 0.04}, velocities=(9.0, -9.0))])
        == ()
    )


def shaking(seed: int, stutter_rad: float, noise_rad: float) -> Signals:
    """Let the position stutter in its encoder's noise."""
    signals = stuttering(seed, stutter_rad)
    assert signals.position_rad is not None
    noise = noise_rad * np.random.default_rng(seed).standard_normal(signals.position_rad.size)
    return dataclasses.replace(signals, position_rad=signals.position_rad + noise)


@pytest.mark.parametrize(
    ("left_rad", "noise_rad", "motion", "words"),
    [
        (0.0, 1e-3, GONE, "gone at order 6 (below 0."),
        (1e-3, 1e-3, DOWN, "down to 1"),
        (0.02, 1e-3, UP, "up to 2"),
        (0.0, 0.2, HIDDEN, "hidden by noise at order 6 (below "),
    ],
)
def test_stutter_is_gone_only_where_noise_is_low_enough_to_show_it(
    left_rad: float, noise_rad: float, motion: str, words: str
) -> None:
    (change,) = compare_ripple([shaking(5, 0.01, 1e-3)], [shaking(6, left_rad, noise_rad)], 40.0)
    order = change.at(6.0)
    assert order is not None
    assert order.motion == motion
    assert words in motion_sentence(change)
    assert "the compensation is part of it" in motion_sentence(change)


def test_stutter_of_noise_alone_is_called_a_stutter_as_often_as_said() -> None:
    """2 x 120 chances are even: 5 % of them below 0.05, of 240 more than 25 once in a thousand."""
    rng = np.random.default_rng(11)
    angle = np.linspace(0.0, 8.0 * TAU, 4000)
    chances: list[float] = []
    for _ in range(8):
        noise = 1e-3 * rng.standard_normal((2, angle.size))
        both = [AnglePass(angle, angle * 0.0, 3.0, True, "noise", n) for n in noise]
        grid = grid_for(both, 40.0)
        for side in ([both[0]], both):
            chances += stutter_chances(side, [2.0 + 2.5 * k for k in range(15)], grid)
    below = float(np.mean(np.array(chances) < 0.05))
    assert below < 25 / 240
    assert 0.4 < float(np.mean(chances)) < 0.6


def test_a_head_counts_only_where_it_has_settled() -> None:
    """The order's error falls with the length of the pass, unless its torque still settles."""
    own = [p for p in passes_of(passes(10, {6.0: 0.04}, velocities=(3.0, -3.0))) if p.whole]
    assert own
    for one in own:
        assert one.whole is not None
        assert one.turns < 0.95 * one.whole.turns
        assert one.settled((6.0,)) is one.whole
        head = one.whole.angle_rad.size - one.angle_rad.size
        unsettled = one.whole.signal.copy()
        unsettled[:head] += 0.05 * np.exp(-np.arange(head) / head)
        late = dataclasses.replace(one, whole=dataclasses.replace(one.whole, signal=unsettled))
        assert late.settled((6.0,)) is late


@pytest.mark.parametrize(
    ("signals", "reason"),
    [
        (passes(1, {}, velocities=(0.3, -0.3), seconds=4.0), "motor turns"),
        (passes(1, {}, velocities=(0.0, 0.0)), "no pass at constant velocity"),
    ],
)
def test_what_carries_no_ripple_says_why(signals: Signals, reason: str) -> None:
    found = find_ripple([signals])
    assert not found.decidable
    assert not found.lines
    assert found.reasons[0].startswith("not identified")
    assert reason in found.reasons[0]
    assert found.to_json()["lines"] == []


def test_bad_arguments_are_refused() -> None:
    with pytest.raises(ValueError, match="at least one recording"):
        find_ripple([])
    with pytest.raises(ValueError, match="highest order above 0"):
        find_ripple([passes(1, {}, seconds=1.0)], highest_order=-1.0)
