"""A law that is another torque in the written twin than it was as a column has run away."""

from __future__ import annotations

from dataclasses import replace

from agent.explain.numbers.model import extended_twin
from agent.explain.numbers.written import not_as_found
from agent.explain.rows.table import tabulate
from agent.explain.study import study
from agent.identify.result import Parameter
from tests.lessons.test_spot_and_load import GRAVITY_NM, heavy_arm_with_a_tight_spot
from tests.science.explain_joint import TWIN, Conditions, record, stair


def test_the_law_that_spoils_the_written_twin_is_told_from_the_others() -> None:
    """7411: friction as large as its load, a cable in truth; 95 times the noise was left."""
    twin = replace(TWIN, gravity_sin_nm=GRAVITY_NM)
    runs = [
        record(stair((3, 10, 30, 60), stroke, 20.0), heavy_arm_with_a_tight_spot, Conditions(), k)
        for k, stroke in enumerate((170.0, 200.0, 230.0))
    ]
    found = study(twin, tabulate(twin, runs))
    assert not_as_found(found.library, twin, found.model, found.extended) == set()
    for index, term in enumerate(found.model.terms):
        numbers = list(found.model.parameters)
        size = term.scored.form.linear[0]
        numbers[index] = {**numbers[index], size: Parameter(9.0 * numbers[index][size].value, None)}
        away = replace(found.model, parameters=tuple(numbers))
        written = extended_twin(found.library, twin, away)
        spoiled = {(term.scored.form.effect, term.scored.form.name)}
        assert not_as_found(found.library, twin, away, written) == spoiled
