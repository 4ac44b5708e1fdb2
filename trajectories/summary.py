"""The dry run: what a trajectory would do, in numbers and in words, before anything moves."""

from __future__ import annotations

from dataclasses import dataclass

from trajectories.arm import arm_deg
from trajectories.checks import positive
from trajectories.extrema import TorqueModel, largest, states
from trajectories.lasting import lasting
from trajectories.limits import AxisLimits, Excess, Margin, check, margins
from trajectories.trajectory import Trajectory


@dataclass(frozen=True)
class Summary:
    """What a trajectory would do; motor side unless the name says arm.

    `steady_velocities` counts distinct signed velocities. Speeds and dwell of the steady windows
    are None where there is no window, the arm's angles without a gear ratio, the torque without a
    model; `margins` is empty without limits.
    """

    name: str
    duration_s: float
    start_position_rad: float
    end_position_rad: float
    position_min_rad: float
    position_max_rad: float
    arm_min_deg: float | None
    arm_max_deg: float | None
    peak_speed_rad_s: float
    peak_acceleration_rad_s2: float
    peak_jerk_rad_s3: float
    peak_torque_nm: float | None
    steady_velocities: int
    steady_speed_min_rad_s: float | None
    steady_speed_max_rad_s: float | None
    shortest_dwell_s: float | None
    gear_ratio: float | None
    margins: tuple[Margin, ...]
    excesses: tuple[Excess, ...]

    def arm_angle(self, angle_rad: float) -> float:
        """Return a motor angle as degrees of the arm; as it is where no gear ratio was given."""
        return angle_rad if self.gear_ratio is None else arm_deg(angle_rad, self.gear_ratio)

    def lines(self) -> tuple[str, ...]:
        """Return the dry run as sentences for a technician, one a line."""
        return (*self._motion_lines(), *self._limit_lines())

    def _motion_lines(self) -> list[str]:
        start, end, low, high = (
            _number(position, ".1f")
            for position in (
                self.start_position_rad,
                self.end_position_rad,
                self.position_min_rad,
                self.position_max_rad,
            )
        )
        ways = f"starts and ends at {start}" if start == end else f"from {start} to {end}"
        out = [
            f"{self.name}: {lasting(self.duration_s)}, {ways} rad (motor)",
            f"positions {low} to {high} rad (motor)",
        ]
        if self.arm_min_deg is not None and self.arm_max_deg is not None:
            arm = f"{_number(self.arm_min_deg, '.2f')} to {_number(self.arm_max_deg, '.2f')}"
            out[-1] += f", {arm} degrees (arm)"
        out.append(
            f"peak speed {self.peak_speed_rad_s:.1f} rad/s, acceleration "
            f"{self.peak_acceleration_rad_s2:.0f} rad/s², jerk {self.peak_jerk_rad_s3:.0f} rad/s³"
        )
        if self.shortest_dwell_s is None:
            out.append("no steady velocity")
        else:
            noun = "velocity" if self.steady_velocities == 1 else "velocities"
            out.append(
                f"{self.steady_velocities} steady {noun}, speeds "
                f"{self.steady_speed_min_rad_s:.2f} to {self.steady_speed_max_rad_s:.2f} rad/s, "
                f"held for at least {self.shortest_dwell_s:.2f} s"
            )
        if self.peak_torque_nm is not None:
            out.append(f"estimated torque at most {self.peak_torque_nm:.2f} N m")
        return out

    def _limit_lines(self) -> list[str]:
        if not self.margins:
            return ["not checked against limits"]
        kept = [margin for margin in self.margins if not margin.exceeded]
        ends = [m for m in kept if m.quantity == "position"]
        rest = [_left(m) for m in kept if m.quantity != "position"]
        out = [self._window_left(ends)] if ends else []
        out += [f"left: {', '.join(rest)}"] if rest else []
        out += [f"REFUSED: {_superscript(excess.sentence)}" for excess in self.excesses]
        if not self.excesses:
            out.append("within all limits")
        return out

    def _window_left(self, ends: list[Margin]) -> str:
        """Say what is left before the window's ends: of the arm, where its gear is known."""
        unit = "rad (motor)" if self.gear_ratio is None else "degrees (arm)"
        pairs = [(self.arm_angle(m.remaining), self.arm_angle(m.limit)) for m in ends]
        said = ", ".join(f"{_three_digits(left)} before {_number(end, 'g')}" for left, end in pairs)
        return f"left of the window, stopping distance included: {said} {unit}"


def _left(margin: Margin) -> str:
    """Say what is left of a limit that has one side."""
    unit = _superscript(margin.unit)
    return f"{margin.quantity} {_three_digits(margin.remaining)} of {margin.limit:g} {unit}"


def _number(value: float, form: str) -> str:
    """Return a number by a format, with a true minus sign and no negative zero."""
    text = f"{value:{form}}"
    return text.lstrip("-") if not text.strip("-0.") else text.replace("-", "−")


def _superscript(text: str) -> str:
    """Return units as people write them: rad/s², rad/s³."""
    return text.replace("^2", "²").replace("^3", "³")


def _three_digits(value: float) -> str:
    """Return a number to three digits, and without a power of ten up to a million."""
    return _number(float(f"{value:.3g}"), "g")


def summarise(
    trajectory: Trajectory,
    limits: AxisLimits | None = None,
    torque_model: TorqueModel | None = None,
    gear_ratio: float | None = None,
) -> Summary:
    """Return the dry run of a trajectory.

    Parameters
    ----------
    trajectory : Trajectory
    limits : AxisLimits, optional
        For the margins.
    torque_model : TorqueModel, optional
        For the torque estimate.
    gear_ratio : float, optional
        Motor turns per arm turn, for the arm's angles.
    """
    ratio = None if gear_ratio is None else positive("gear_ratio", gear_ratio)
    instants = states(trajectory, None, torque_model)
    windows = trajectory.steady_windows()
    speeds = [abs(w.velocity_rad_s) for w in windows]
    low = -largest(instants, lambda s: -s.position_rad).value
    high = largest(instants, lambda s: s.position_rad).value
    return Summary(
        name=trajectory.name,
        duration_s=trajectory.duration_s,
        start_position_rad=trajectory.start_position_rad,
        end_position_rad=trajectory.end_position_rad,
        position_min_rad=low,
        position_max_rad=high,
        arm_min_deg=None if ratio is None else arm_deg(low, ratio),
        arm_max_deg=None if ratio is None else arm_deg(high, ratio),
        peak_speed_rad_s=largest(instants, lambda s: abs(s.velocity_rad_s)).value,
        peak_acceleration_rad_s2=largest(instants, lambda s: abs(s.acceleration_rad_s2)).value,
        peak_jerk_rad_s3=largest(instants, lambda s: abs(s.jerk_rad_s3)).value,
        peak_torque_nm=None
        if torque_model is None
        else largest(
            instants,
            lambda s: torque_model.magnitude_nm(s.velocity_rad_s, s.acceleration_rad_s2),
        ).value,
        steady_velocities=len({w.velocity_rad_s for w in windows}),
        steady_speed_min_rad_s=min(speeds, default=None),
        steady_speed_max_rad_s=max(speeds, default=None),
        shortest_dwell_s=min((w.end_s - w.start_s for w in windows), default=None),
        gear_ratio=ratio,
        margins=() if limits is None else margins(trajectory, limits, torque_model),
        excesses=() if limits is None else check(trajectory, limits, torque_model),
    )
