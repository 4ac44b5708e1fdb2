"""An estimate as a technician reads it in a terminal."""

from __future__ import annotations

from collections.abc import Mapping

from agent.identify.result import Estimate, Parameter
from agent.identify.sentence import percent
from agent.numbers import parameter_label, parameter_unit, scale_for, significant, written


def summary(estimate: Estimate) -> str:
    """Return the verdict and the numbers behind it, a line each.

    An estimate that is not decidable shows its reasons and no numbers.
    """
    if not estimate.decidable:
        if len(estimate.reasons) == 1:
            return estimate.sentence
        return "\n".join(["Not decidable:", *(f"  - {reason}" for reason in estimate.reasons)])
    lines = [estimate.sentence]
    selected = estimate.selected_model
    if selected is not None:
        lines.append(
            f"\nFriction curve: {selected.model}, {_torque(selected.rmse_nm)} rms is left, "
            f"fit {percent(selected.fit_percent)}"
        )
        lines += _parameters(selected.parameters)
    body = estimate.rigid_body
    if body is not None:
        lines.append(
            f"\nRigid body: {_torque(body.rmse_nm)} rms is left, fit {percent(body.fit_percent)}, "
            f"condition number {body.condition_number:.3g}"
        )
        lines += _parameters(body.parameters)
    if estimate.validation is not None:
        unseen = estimate.validation
        lines.append(
            f"\nValidation on {unseen.recording}: fit {percent(unseen.fit_percent)}, "
            f"relative torque error {unseen.relative_torque_error_percent:.2f} %"
        )
    if estimate.notes:
        lines += ["", *(f"Note: {note}." for note in estimate.notes)]
    return "\n".join(lines)


def _torque(torque_nm: float) -> str:
    scale = scale_for("N m", (torque_nm,))
    return f"{significant(scale.factor * torque_nm, 3)} {scale.unit}"


def _parameters(parameters: Mapping[str, Parameter]) -> list[str]:
    return [
        f"  {parameter_label(name):<40} {_value(name, parameter)}"
        for name, parameter in parameters.items()
    ]


def _value(name: str, parameter: Parameter) -> str:
    if not parameter.identified or parameter.ci95 is None:
        return f"not identified: {parameter.reason}"
    scale = scale_for(parameter_unit(name), (parameter.value,))
    value, interval, _ = written(parameter, scale.factor)
    return f"{value:>10} {scale.unit:<12} ({interval})".rstrip()
