"""Which effects a recording confuses, why, and what measurement tells them apart: one table.

Every pair is written once and read from both sides.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class LookAlike:
    """Another effect that a recording may confuse with this one.

    Parameters
    ----------
    effect : str
        Its id.
    because : str
        Why the two look alike; half a sentence.
    told_apart_by : str
        Which measurement tells them apart; one sentence or two.
    """

    effect: str
    because: str
    told_apart_by: str


def look_alikes(effect: str) -> tuple[LookAlike, ...]:
    """Return what an effect can be mistaken for, the likeliest first."""
    found = []
    for first, second, because, told_apart_by in PAIRS:
        if effect in (first, second):
            other = second if effect == first else first
            found.append(LookAlike(other, because, told_apart_by))
    return tuple(found)


_BOTH_WAYS = "Pass the same places in both directions: friction turns its sign with the motion"
_OTHER_WAY = "Drive the same speeds in the other direction, too: wrong Coulomb friction"
_LONGER = "Repeat the cycle over a longer stroke, or about another arm angle"
_SPEEDS = "Repeat at several speeds"
_TWO_RAMPS = "Make the same reversal at two accelerations: a delay keeps its seconds"
_RATIOS = "Compare inertia, gravity and friction with their known values: a wrong torque constant"

PAIRS: tuple[tuple[str, str, str, str], ...] = (
    (
        "stribeck",
        "viscous-nonlinear",
        "both bend the friction curve, and above the lowest speed they bend it alike",
        "Add steady speeds down to a quarter of the lowest one: the Stribeck curve rises towards"
        " standstill, a bent viscous line does not.",
    ),
    (
        "stribeck",
        "presliding-hysteresis",
        "both change friction near standstill",
        "Drive long, slow, steady windows: Stribeck friction lasts as long as the speed does,"
        " presliding is over after a small travel.",
    ),
    (
        "direction-asymmetry",
        "torque-offset",
        "a Coulomb level that differs by direction and a constant torque are the same column while"
        " the joint slides",
        "Read the drive's torque with the brake closed and the power stage off, which shows an"
        " offset alone.",
    ),
    (
        "direction-asymmetry",
        "gravity-imbalance",
        "on a short stroke gravity is nearly constant, as a difference of the directions is",
        f"{_LONGER}.",
    ),
    (
        "gravity-imbalance",
        "torque-offset",
        "on a short stroke gravity is nearly constant",
        f"{_LONGER}: gravity changes with the angle, an offset stays.",
    ),
    (
        "gravity-imbalance",
        "cable-force",
        "on a short stroke a cosine is nearly a straight line",
        "Repeat the cycle over a longer stroke, or with a second payload: a cable does not feel"
        " the payload.",
    ),
    (
        "gravity-imbalance",
        "torque-ripple",
        "behind a gear of one to one the arm's angle is the motor's, and both repeat with its turn",
        "Repeat the cycle with another payload, or with the axis mounted another way: a weight"
        " changes, ripple does not.",
    ),
    (
        "cable-force",
        "torque-offset",
        "on a short stroke a spring's pull is nearly constant",
        f"{_LONGER}: a cable's pull changes with the angle, an offset stays.",
    ),
    (
        "cable-force",
        "direction-asymmetry",
        "on a short stroke a spring's pull is nearly constant, as a difference of the directions"
        " is",
        f"{_LONGER}: a cable's pull changes with the angle, a difference of the directions stays.",
    ),
    (
        "temperature-dependent-friction",
        "friction-drift",
        "in one warm-up temperature and time rise together",
        "Run the same speeds at equal gearbox temperature while heating and while cooling, or after"
        " a warm restart.",
    ),
    (
        "temperature-dependent-friction",
        "torque-constant-error",
        "warm magnets give less torque, as warm oil does",
        "Hold a load against gravity, cold and warm: friction plays no part in the mean of raising"
        " and lowering it.",
    ),
    (
        "temperature-dependent-friction",
        "viscous-nonlinear",
        "fast windows warm the gear, and warm oil is thinner",
        "Repeat the fastest windows first and last, at equal gearbox temperature.",
    ),
    (
        "load-dependent-friction",
        "position-dependent-friction",
        "gravity's load is a function of the arm's position",
        "Repeat the cycle with another payload, or with the stroke shifted: friction that follows"
        " the load changes, friction that follows the place does not.",
    ),
    (
        "load-dependent-friction",
        "torque-constant-error",
        "both grow with the torque",
        "Raise and lower the same load: friction turns with the direction, a wrong constant does"
        " not.",
    ),
    (
        "position-dependent-friction",
        "torque-ripple",
        "both repeat with the position",
        f"{_BOTH_WAYS}, ripple does not.",
    ),
    (
        "position-dependent-friction",
        "local-fault",
        "both sit at one place, and a fault that rubs turns its sign with the motion, as friction"
        " does",
        "Pass the place slowly, in both directions, over a longer stroke: a fault is narrow and"
        " comes once, friction of the path is wide or returns elsewhere.",
    ),
    (
        "local-fault",
        "torque-ripple",
        "a single period of a low order looks like a bump",
        "Extend the stroke beyond one period: ripple returns, a local fault does not.",
    ),
    (
        "torque-ripple",
        "kinematic-error",
        "both appear at the same order of the position",
        f"{_SPEEDS}: the amplitude of ripple stays, that of a wobbling gear grows with speed.",
    ),
    (
        "torque-ripple",
        "resolver-error",
        "a wrong angle makes the speed controller push at the same order",
        f"{_SPEEDS}: the amplitude of ripple stays, that of a wrong angle grows with speed.",
    ),
    (
        "kinematic-error",
        "resolver-error",
        "both are errors of an angle at the same order",
        "Record the arm's own encoder: the wave that it shows beside the motor's shakes the arm "
        "alone where the gear wobbles, and the motor with it where the motor's angle is misread.",
    ),
    (
        "torque-ripple",
        "inertia-error",
        "the speed controller turns ripple into acceleration at the same order",
        "Use the commanded acceleration in place of the measured one, or repeat with another"
        " controller gain: inertia follows the command.",
    ),
    (
        "presliding-hysteresis",
        "backlash",
        "both change the torque within a small travel after a reversal",
        "Reverse with halving amplitudes under load: a gap is lost motion of constant size and ends"
        " in an impact, presliding is smooth and shrinks with the amplitude.",
    ),
    (
        "presliding-hysteresis",
        "measurement-delay",
        "friction that builds up after a reversal is late, as a late signal is",
        f"{_TWO_RAMPS}, presliding its travel.",
    ),
    (
        "presliding-hysteresis",
        "joint-flexibility",
        "a spring winds up at every reversal in both",
        "Change speed without reversing: only a flexible joint rings there.",
    ),
    (
        "presliding-hysteresis",
        "cable-force",
        "a bundle with inner friction lags behind after a reversal as well",
        "Compare the travel: a bundle needs degrees of the arm, presliding far below one.",
    ),
    (
        "joint-flexibility",
        "backlash",
        "both let motor and arm move apart at a reversal",
        "Change speed without reversing: a soft arm rings there, a gap stays closed. With the arm's"
        " encoder: a twist in proportion to torque is a spring, a step is a gap.",
    ),
    (
        "joint-flexibility",
        "measurement-delay",
        "a late torque, or a skew between two encoders, looks like a twist that follows"
        " acceleration",
        "Turn at several steady speeds: a skew of the encoders is an angle that grows with speed,"
        " a spring's twist is not; and only a spring rings.",
    ),
    (
        "joint-flexibility",
        "inertia-error",
        "below its resonance a soft arm feels like another inertia",
        "Accelerate more sharply: only a soft arm rings.",
    ),
    (
        "backlash",
        "measurement-delay",
        "torque that turns over late is lost motion, too",
        f"{_TWO_RAMPS}, a gap its travel.",
    ),
    (
        "wrong-number",
        "friction-drift",
        "both are another friction level than the one that was written down",
        "Repeat the cycle on later days at equal temperature: a wrong number stays as it is.",
    ),
    (
        "wrong-number",
        "torque-constant-error",
        "a wrong torque constant scales friction",
        f"{_RATIOS} is off by one factor in all of them.",
    ),
    (
        "wrong-number",
        "torque-offset",
        "in one direction Coulomb friction is a constant torque",
        f"{_OTHER_WAY} turns its sign with the motion, an offset stays.",
    ),
    (
        "wrong-number",
        "direction-asymmetry",
        "in one direction another Coulomb level and one that is that direction's own are the same",
        f"{_OTHER_WAY} is as much off there, a difference of the directions by as much the other"
        " way.",
    ),
    (
        "inertia-error",
        "torque-constant-error",
        "a wrong torque constant scales inertia",
        f"{_RATIOS} is off by one factor in all of them.",
    ),
    (
        "friction-drift",
        "torque-constant-error",
        "a motor whose constant changes scales friction as well",
        "Compare inertia and gravity of the same runs: wear leaves them alone.",
    ),
    (
        "torque-saturation",
        "inertia-error",
        "clipped torque at high acceleration looks like a smaller inertia",
        "Repeat with half the acceleration: below the limit the mismatch is gone.",
    ),
    (
        "torque-saturation",
        "viscous-nonlinear",
        "clipped torque at high speed looks like friction that bends",
        "Watch the tops of the torque: a limit makes them flat while the velocity falls short of"
        " its command.",
    ),
)
"""First effect, second effect, why they look alike, what tells them apart; the likeliest first."""
