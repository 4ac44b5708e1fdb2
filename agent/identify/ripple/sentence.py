"""What anticogging does, in a sentence for a technician: the motion's stutter, and the current.

What compensation is for is the motion; its torque is the drive's current, of which it is itself a
part. "Gone" is said of a stutter that cannot be told from noise, with the limit below which it
then lies, and of nothing else.
"""

from __future__ import annotations

from collections.abc import Sequence

from agent.identify.result import Parameter
from agent.identify.ripple.change import DOWN, GONE, HIDDEN, SAME, UP, OrderChange, RippleChange
from agent.numbers import significant

_MATTERS = 0.25  # of the strongest stutter without: weaker ones do not make the motion


def motion_sentence(change: RippleChange) -> str:
    """Return what anticogging does to the motion and to the torque at one speed.

    Parameters
    ----------
    change : RippleChange
        With at least one order.
    """
    speed = f"At {change.velocity_rad_s:.3g} rad/s"
    orders = strongest(change.orders)
    if not orders:
        known = [o for o in change.orders if o.stutter_rad[0].identified]
        if not known:
            return f"{speed} nothing can be said of the motion: {_reason(change.orders)}."
        return f"{speed} the position does not stutter beyond its noise even without anticogging."
    parts = [part for verdict in (DOWN, UP, SAME, GONE, HIDDEN) for part in _part(orders, verdict)]
    return f"{speed} the motion's stutter with anticogging on is {'; '.join(parts)}. " + _torque(
        orders
    )


def strongest(orders: Sequence[OrderChange]) -> list[OrderChange]:
    """Return the orders whose stutter makes the motion, by rising order."""
    judged = [o for o in orders if o.motion]
    most = max((o.stutter_rad[0].value for o in judged), default=0.0)
    kept = [o for o in judged if max(p.value for p in o.stutter_rad) >= _MATTERS * most]
    return sorted(kept, key=lambda o: o.order_per_motor_rev)


def _part(orders: Sequence[OrderChange], verdict: str) -> list[str]:
    """Return "down to 20 % (18 to 22) at order 7 and 14 % (11 to 16) at 14", or nothing."""
    own = [o for o in orders if o.motion == verdict]
    if not own:
        return []
    if verdict in (GONE, HIDDEN):
        places = [f"{_order(o)} (below {_limit(o)}, its noise; {_before(o)} without)" for o in own]
        words = "gone at order" if verdict == GONE else "hidden by noise at order"
    else:
        places = [f"{_percent(o.stutter_left)} at order {_order(o)}" for o in own]
        words = {DOWN: "down to", UP: "up to", SAME: "not surely changed:"}[verdict]
    return [f"{words} {_listed(places)}"]


def _order(order: OrderChange) -> str:
    return f"{round(order.order_per_motor_rev, 1):g}"


def _limit(order: OrderChange) -> str:
    on = order.stutter_rad[1]
    return _mrad(on.ci95[1] if on.ci95 is not None else on.value)


def _before(order: OrderChange) -> str:
    return _mrad(order.stutter_rad[0].value)


def _torque(orders: Sequence[OrderChange]) -> str:
    """Return what is left of the torque's ripple at these orders, and why that may be all."""
    left = [o.torque_left.value for o in orders if o.torque_left.identified]
    if not left:
        return "Of the torque's ripple nothing can be said."
    low, high = 100.0 * min(left), 100.0 * max(left)
    span = f"{low:.0f} %" if round(low) == round(high) else f"{low:.0f} to {high:.0f} %"
    return (
        f"The torque's ripple is at {span} of what it was there: the torque is the drive's "
        "current, and the compensation is part of it, so that it need not fall."
    )


def _reason(orders: Sequence[OrderChange]) -> str:
    return orders[0].stutter_rad[0].reason or orders[0].stutter_rad[1].reason


def _percent(left: Parameter) -> str:
    low, high = left.ci95 if left.ci95 is not None else (left.value, left.value)
    return f"{100.0 * left.value:.0f} % ({100.0 * low:.0f} to {100.0 * high:.0f})"


def _mrad(value_rad: float) -> str:
    return f"{significant(1e3 * value_rad, 2)} mrad"


def _listed(parts: Sequence[str]) -> str:
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}"
