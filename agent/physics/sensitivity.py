"""How a friction law's torque answers to its parameters: what experiment design stands on."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from agent.physics.friction import FrictionLaw

Floats = NDArray[np.float64]

_STEP = 1e-5


def sensitivity(law: FrictionLaw, parameters: Mapping[str, float]) -> Callable[[Floats], Floats]:
    """Return the function from speeds, shape (n,), to the torque's derivatives, shape (n, p).

    The columns stand in the order of ``law.parameters``, in N m per unit of each. The linear ones
    are the law's own columns; the non-linear ones are central differences.

    Parameters
    ----------
    law : FrictionLaw
    parameters : mapping of str to float
        Where the derivatives are taken; every non-linear one above zero.

    Raises
    ------
    ValueError
        A parameter is missing, or a non-linear one is not above zero.
    """
    values = {name: float(parameters[name]) for name in law.parameters if name in parameters}
    wrong = [n for n in law.parameters if n not in values]
    wrong += [n for n in law.nonlinear if not values.get(n, 1.0) > 0.0]
    if wrong:
        raise ValueError(
            f"{law.name}: expected {', '.join(law.parameters)}, the non-linear ones above zero; "
            f"check {', '.join(wrong)}"
        )

    def derivatives(speed_rad_s: Floats) -> Floats:
        linear = law.columns(speed_rad_s, *(values[name] for name in law.nonlinear))
        columns = [linear[:, k] for k in range(linear.shape[1])]
        for name in law.nonlinear:
            step = _STEP * values[name]
            above, below = (
                law.torque(speed_rad_s, {**values, name: values[name] + sign * step})
                for sign in (1.0, -1.0)
            )
            columns.append((above - below) / (2.0 * step))
        return np.stack(columns, axis=-1)

    return derivatives
