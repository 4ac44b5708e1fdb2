"""What was told beside a torque constant falls with it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from agent.explain.choosing.search import Library
from agent.explain.numbers.borne_out import borne_out
from agent.explain.numbers.model import Model
from agent.explain.numbers.wrong import WrongNumber
from agent.identify.result import Parameter


@pytest.mark.parametrize(("share", "told"), [(0.01, 0), (1.0, 2)])
def test_a_weight_beside_a_torque_constant_that_is_not_borne_out_is_none(
    share: float, told: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """ "Gravity's sine part is 4.09, not 4.46 N m", of a twin that says 4.10."""
    monkeypatch.setattr("agent.explain.numbers.borne_out.unseen_nm2", lambda *_: 100.0)
    constant = WrongNumber("torque-constant-error", share, {"factor": Parameter(1.09, (1.08, 1.1))})
    weight = WrongNumber(
        "gravity-imbalance", 1.0, {"gravity_sin_nm": Parameter(-0.37, (-0.4, -0.3))}
    )
    library = cast("Library", SimpleNamespace(target=np.zeros(9)))
    model = cast("Model", SimpleNamespace(residual_nm=1.5 * np.ones(9)))
    assert len(borne_out((constant, weight), library, model, 1.0)) == told
