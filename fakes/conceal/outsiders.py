"""Effects that no library of ours has: what is right to say of them is "unexplained, and here"."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fakes.conceal.concealment import (
    Concealment,
    Maker,
    Region,
    angle,
    either_sign,
    numbers,
    scaled,
    whole_axis,
)
from fakes.conceal.robot import Robot
from fakes.conceal.truth import Truth

PREFIX = "outsider:"


def mains_pickup(rng: np.random.Generator, robot: Robot) -> Concealment:
    """Conceal the mains in the reported torque."""
    hertz = float(rng.choice((50.0, 60.0))) + rng.uniform(-0.05, 0.05)
    return Concealment(
        PREFIX + "mains-pickup",
        "sine in time",
        scaled({"mains_nm": 1.0}, {"mains_hz": hertz, "mains_phase_rad": angle(rng)}),
        1.5 * robot.floor_nm,
        robot.truth.dry_nm,
        whole_axis("frequency_hz", hertz - 1.0, hertz + 1.0),
        numbers(amplitude_nm="mains_nm", frequency_hz="mains_hz"),
    )


def settling_grease(rng: np.random.Generator, robot: Robot) -> Concealment:
    """Conceal friction that settles after each start, otherwise in one direction than the other."""
    time = rng.uniform(3.0, 8.0)
    fixed = {"settling_time_s": time, "settling_backward": rng.uniform(-0.8, 0.4)}
    return Concealment(
        PREFIX + "settling-grease",
        "exponential in time since start",
        scaled({"settling_nm": 1.0}, fixed),
        3.0 * robot.floor_nm,
        1.5 * robot.truth.dry_nm,
        whole_axis("time_s", 0.0, 1.6 * time),
        numbers(amplitude_nm="settling_nm", time_s="settling_time_s", backward="settling_backward"),
    )


def ageing_contact(rng: np.random.Generator, robot: Robot) -> Concealment:
    """Conceal dry friction that grows while the joint dwells, and wears off over a travel."""
    travel = rng.uniform(4.0, 15.0)
    fixed = {"dwell_time_s": rng.uniform(0.1, 0.4), "dwell_travel_rad": travel}
    return Concealment(
        PREFIX + "ageing-contact",
        "grows with dwell, decays with travel",
        scaled({"dwell_nm": 1.0}, fixed),
        6.0 * robot.floor_nm,
        2.0 * robot.truth.dry_nm,
        whole_axis("after_reversal_s", 0.0, 1.6 * travel / (0.2 * robot.top_rad_s)),
        numbers(
            amplitude_nm="dwell_nm", dwell_time_s="dwell_time_s", travel_rad="dwell_travel_rad"
        ),
    )


def speeding_up(rng: np.random.Generator, robot: Robot) -> Concealment:
    """Conceal friction that is higher while the joint speeds up than while it slows down."""
    top = robot.acceleration_rad_s2
    return Concealment(
        PREFIX + "speeding-up",
        "level follows the sign of power",
        scaled(
            {"speeding_up_nm": either_sign(rng)},
            {"speeding_up_rad_s2": top * rng.uniform(0.02, 0.1)},
        ),
        3.0 * robot.floor_nm,
        0.8 * robot.truth.dry_nm,
        lambda truth: (
            Region("acceleration_rad_s2", -top, -truth.speeding_up_rad_s2),
            Region("acceleration_rad_s2", truth.speeding_up_rad_s2, top),
        ),
        numbers(amplitude_nm="speeding_up_nm", scale_rad_s2="speeding_up_rad_s2"),
    )


def speed_play(rng: np.random.Generator, robot: Robot) -> Concealment:
    """Conceal a hysteresis along the position that widens with speed."""
    width = rng.uniform(8.0, 20.0)
    fixed = {"play_half_width_rad": width, "play_velocity_rad_s": 0.3 * robot.top_rad_s}

    def where(truth: Truth) -> tuple[Region, ...]:
        del truth
        top = robot.top_rad_s
        return (
            Region("velocity_rad_s", -top, top),
            Region("after_reversal_s", 0.0, 8.0 * width / top),
        )

    return Concealment(
        PREFIX + "speed-play",
        "play operator times speed",
        scaled({"play_nm": either_sign(rng)}, fixed),
        3.0 * robot.floor_nm,
        2.0 * robot.truth.dry_nm,
        where,
        numbers(amplitude_nm="play_nm", half_width_rad="play_half_width_rad"),
    )


def neighbour_beat(rng: np.random.Generator, robot: Robot) -> Concealment:
    """Conceal bursts of swinging that another axis causes."""
    hertz, beat = rng.uniform(1.0, 6.0), rng.uniform(0.08, 0.25)
    return Concealment(
        PREFIX + "neighbour-beat",
        "bursts in time",
        scaled({"neighbour_nm": 1.0}, {"neighbour_hz": hertz, "neighbour_beat_hz": beat}),
        3.0 * robot.floor_nm,
        robot.truth.dry_nm,
        whole_axis("frequency_hz", hertz - 2.0 * beat, hertz + 2.0 * beat),
        numbers(amplitude_nm="neighbour_nm", frequency_hz="neighbour_hz"),
    )


def churning_band(rng: np.random.Generator, robot: Robot) -> Concealment:
    """Conceal friction that peaks, or dips, in one band of speeds."""
    middle = robot.top_rad_s * rng.uniform(0.25, 0.5)
    width = middle * rng.uniform(0.25, 0.4)
    fixed = {"churning_velocity_rad_s": middle, "churning_width_rad_s": width}
    low, high = middle - 1.27 * width, middle + 1.27 * width
    return Concealment(
        PREFIX + "churning-band",
        "bell along the speed",
        scaled({"churning_nm": either_sign(rng)}, fixed),
        3.0 * robot.floor_nm,
        robot.truth.dry_nm,
        lambda _: (Region("velocity_rad_s", -high, -low), Region("velocity_rad_s", low, high)),
        numbers(amplitude_nm="churning_nm", velocity_rad_s="churning_velocity_rad_s"),
    )


def snapping_seal(rng: np.random.Generator, robot: Robot) -> Concealment:
    """Conceal a seal that snaps between two seats, seconds apart, whatever the joint does."""
    period = rng.uniform(4.0, 9.0)
    return Concealment(
        PREFIX + "snapping-seal",
        "two levels, switched in time",
        scaled({"seal_nm": 1.0}, {"seal_period_s": period}),
        1.5 * robot.floor_nm,
        0.6 * robot.truth.dry_nm,
        whole_axis("time_s", 0.0, 30.0),
        numbers(amplitude_nm="seal_nm", period_s="seal_period_s"),
    )


OUTSIDERS: Mapping[str, Maker] = {
    PREFIX + "mains-pickup": mains_pickup,
    PREFIX + "settling-grease": settling_grease,
    PREFIX + "ageing-contact": ageing_contact,
    PREFIX + "speeding-up": speeding_up,
    PREFIX + "speed-play": speed_play,
    PREFIX + "neighbour-beat": neighbour_beat,
    PREFIX + "churning-band": churning_band,
    PREFIX + "snapping-seal": snapping_seal,
}
"""Every outsider's maker by its label."""
