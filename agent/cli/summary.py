"""An estimate as a technician reads it in a terminal."""

from __future__ import annotations

from collections.abc import Mapping

from agent.identify.result import Estimate, Parameter

UNITS = {
    "_nm": "N m",
    "_nm_s_per_rad": "N m s/rad",
    "_rad_s": "rad/s",
    "_kg_m2": "kg m2",
}


def summary(estimate: Estimate) -> str:
    """Return the verdict and the numbers behind it, a line each.

    An estimate that is not decidable shows its reasons and no numbers.
    """
    if not estimate.decidable:
        reasons = "\n".join(f"  - {reason}" for reason in estimate.reasons)
        return f"{estimate.sentence or 'Not decidable.'}\n{reasons}"
    lines = [estimate.sentence]
    selected = estimate.selected_model
    if selected is not None:
        lines.append(
            f"\nfriction curve: {selected.model}, {selected.rmse_nm:.4g} N m rms, "
            f"fit {selected.fit_percent:.1f} %"
        )
        lines += _parameters(selected.parameters)
    body = estimate.rigid_body
    if body is not None:
        lines.append(
            f"\nrigid body: {body.rmse_nm:.4g} N m rms, fit {body.fit_percent:.1f} %, "
            f"condition number {body.condition_number:.3g}"
        )
        lines += _parameters(body.parameters)
    if estimate.validation is not None:
        unseen = estimate.validation
        lines.append(
            f"\nvalidation on {unseen.recording}: fit {unseen.fit_percent:.1f} %, "
            f"relative torque error {unseen.relative_torque_error_percent:.2f} %"
        )
    lines += [f"\nnote: {note}" for note in estimate.notes]
    return "\n".join(lines)


def _parameters(parameters: Mapping[str, Parameter]) -> list[str]:
    return [f"  {name:<26} {_value(name, parameter)}" for name, parameter in parameters.items()]


def _value(name: str, parameter: Parameter) -> str:
    if not parameter.identified or parameter.ci95 is None:
        return f"not identified: {parameter.reason}"
    unit = next((u for ending, u in UNITS.items() if name.endswith(ending)), "")
    low, high = parameter.ci95
    return f"{parameter.value:10.5g}   [{low:.5g}, {high:.5g}] {unit}".rstrip()
