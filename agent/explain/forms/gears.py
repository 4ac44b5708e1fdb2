"""A gear whose spring is not straight, before an arm that slides freely and one that rubs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from agent.explain.forms.arm import (
    Limits,
    bears_the_weight,
    friction_entry,
    friction_limits,
    other_reaches,
    same_friction,
    slowing_rad_s2,
)
from agent.explain.forms.form import Form, Grid, Point, Proportional, stack
from agent.explain.forms.hidden_arm import HiddenArm
from agent.explain.forms.twin_law import best_entry
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats

_FLEXIBLE, _STRAIGHT, _RUBS = "joint-flexibility", "one spring", ", and an arm with friction"
_FRICTION = ("friction_share", "friction_reach_rad")


@dataclass(frozen=True)
class Gear:
    """What carries the arm.

    Parameters
    ----------
    name : str
        Of its form.
    numbers : tuple of str
        Of its spring.
    arm : callable
        Those to the arm behind it, without friction.
    grid, rubbing_grid : callable
        Scene to the points that are tried; with friction, its share and its reach stand last.
    limits, step : callable
        As a form has them, of the spring's numbers.
    entry : callable
        (scene, values by name) to the spring's numbers as the twin names them.
    """

    name: str
    numbers: tuple[str, ...]
    arm: Callable[[Point], HiddenArm]
    grid: Callable[[Scene], Sequence[Point]]
    rubbing_grid: Grid
    limits: Callable[[Scene], Limits]
    step: Callable[[Scene], Point]
    entry: Callable[[Scene, Mapping[str, float]], dict[str, float]]

    @property
    def forms(self) -> tuple[Form, Form]:
        """Return its form, and that of an arm with dry friction of its own."""
        plain = Form(
            _FLEXIBLE,
            self.name,
            ("arm_inertia_kg_m2",),
            self.column,
            self.numbers,
            self.grid,
            (1,),
            at_edges=True,
            step=self.step,
            to_twin=self._twin,
            borne=bears_the_weight,
            limits=self.limits,
            refines=(_STRAIGHT,),
        )
        rubbing = replace(
            plain,
            name=f"{self.name}{_RUBS}",
            columns=self.rubbing,
            nonlinear=(*self.numbers, *_FRICTION),
            grid=self.rubbing_grid,
            step=self._rubbing_step,
            to_twin=self._rubbing_twin,
            limits=self.rubbing_limits,
            refines=(_STRAIGHT, f"{_STRAIGHT}{_RUBS}", self.name),
            rests_on_numbers=True,
            same_beside=_same_friction,
            elsewhere=other_reaches,
        )
        return plain, rubbing

    def column(self, scene: Scene, point: Point) -> Floats:
        """Return the torque of an arm behind it, over its inertia, shape (N, 1)."""
        return stack(self.arm(point).extra_rad_s2(scene))

    def rubbing(self, scene: Scene, point: Point) -> Floats:
        """Return the torque of such an arm that rubs as well, over its inertia, shape (N, 1)."""
        *spring, share, reach = point
        friction = share * slowing_rad_s2(scene)
        arm = replace(self.arm(tuple(spring)), friction_rad_s2=friction, reach_rad=reach)
        return stack(arm.extra_rad_s2(scene))

    def rubbing_limits(self, scene: Scene) -> Limits:
        """Return between which all numbers of such an arm are looked for."""
        return (*self.limits(scene), *friction_limits(scene))

    def _rubbing_step(self, scene: Scene) -> Point:
        return (*self.step(scene), Proportional(0.2), Proportional(0.5))

    def _twin(self, scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
        point = tuple(values[name] for name in self.numbers)
        says = values["arm_inertia_kg_m2"] * self.column(scene, point)[:, 0]
        return best_entry(scene, _FLEXIBLE, [self.entry(scene, values)], says)

    def _rubbing_twin(
        self, scene: Scene, values: Mapping[str, float]
    ) -> Sequence[Mapping[str, Any]]:
        spring = self.entry(scene, values)
        point = tuple(values[name] for name in (*self.numbers, *_FRICTION))
        says = values["arm_inertia_kg_m2"] * self.rubbing(scene, point)[:, 0]
        rubs = {**spring, **friction_entry(scene, values)}
        return best_entry(scene, _FLEXIBLE, [rubs, spring], says)


def _same_friction(before: Scene, now: Scene, point: Point) -> Point:
    """Return the point at which an arm has the friction that it had beside other numbers."""
    *spring, share, reach = point
    return (*spring, same_friction(before, now, share), reach)
