"""A candidate: one form of one effect, linear but for at most two numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from agent.explain.rows.scene import Scene
from agent.identify.result import Floats, Parameter

Point = tuple[float, ...]
Columns = Callable[[Scene, Point], Floats]
Grid = Callable[[Scene], Sequence[Point]]
ToTwin = Callable[[Scene, Mapping[str, float]], Sequence[Mapping[str, Any]]]


class Proportional(float):
    """A step of a non-linear number in proportion to it."""


def stack(*columns: Floats) -> Floats:
    """Return columns of shape (N,) side by side, shape (N, k)."""
    return np.stack(columns, axis=-1)


def _no_grid(scene: Scene) -> Sequence[Point]:
    del scene
    return ((),)


def _as_named(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    del scene
    return (dict(values),)


@dataclass(frozen=True)
class Form:
    """One way in which an effect may show.

    Parameters
    ----------
    effect : str
        Id of contract section 4.
    name : str
        Which of the effect's forms.
    linear : tuple of str
        Names of the coefficients, one for each column.
    columns : callable
        (scene, point) to the full-rate columns, shape (N, k), before the common filter.
    nonlinear : tuple of str
        Names of the numbers that `grid` spans.
    grid : callable
        Scene to the points that are tried; refined around the best one.
    signs : tuple of int
        For every coefficient: 1 where physics only allows it to be positive, else 0.
    highest : tuple of float
        For every coefficient: what it cannot exceed in size; empty where nothing is known.
    needs : tuple of str
        Columns that must have been recorded.
    at_edges : bool
        Whether it is judged at starts and reversals, too.
    refine : bool
        Whether the grid's best point may be moved between its neighbours.
    together : bool
        Whether its numbers are only moved together, as they hang together and are dear to try.
    step : callable, optional
        Scene to how far each non-linear number may be moved, or by which share where that is
        `Proportional`; else the grid's own spacing.
    to_twin : callable
        (scene, values by name) to the parameter tables of the twin's effects.
    limits : callable, optional
        Scene to the lowest and highest value of each non-linear number, where the grid's best point
        may not be moved beyond.
    point_of : callable, optional
        Coefficients, shape (k,), to the point that they themselves ask for, where a trial point
        stands for one of them.
    borne : callable, optional
        (scene, point, coefficients, shape (k,)) to whether this joint could have the law with these
        numbers, as far as that can be told while other effects are still to be found.
    contains : tuple of str
        Effects that are special cases of this form: beside one of them it is no rival.
    refines : tuple of str
        Names of the same effect's forms that are special cases of this one: it must beat them.
    more_usual : tuple of str
        Names of the same effect's forms, as simple as this one, that stand on a tie with it.
    rests_on_numbers : bool
        Whether its columns are made of the twin's own numbers, as a load is of its gravity.
    same_beside : callable, optional
        (scene before, scene now, point) to the point of the same law beside other numbers of the
        twin, where one of its numbers is a share of these.
    elsewhere : callable, optional
        (scene, point, whether to look far from it) to other points where its numbers may lie, where
        its squared error has many valleys.
    typical : tuple of float
        Where its numbers usually are: there it stands where they are not identified.
    once_known : callable, optional
        (scene, point) to other points around it that are worth a trial once the twin's own numbers
        are known beside the law: at others none of them could be right.
    uneven : mapping of str to str
        Non-linear numbers along which the error is rough: fits on either side are compared block
        by block. And the number that is the share of such a one by which the form does not know it.
    from_residual : bool
        Whether its grid is read off what is left: strong effects hide weaker ones from it.
    is_a_mean : callable, optional
        Point to whether the law is the mean over several there, and duller than each of them.
    roughly : mapping of str to float
        Non-linear numbers that make up for that where more than noise is left; and the share of
        each by which luck moves it elsewhere.
    beyond : callable, optional
        (scene, point) to numbers that what is compared is too slow to tell, and why.
    kinds : tuple of str
        Non-linear numbers that say which kind of the law it is: tried, but not measured.
    catch_all : bool
        Whether it may stand for anything that varies with it: others come first on a tie.
    only_clearly : bool
        Whether it is chosen only where it leaves clearly less than any form that it refines.
    rivals_none : bool
        Whether it stands in no other law's place, though it may be chosen: what it adapts to is
        read off what that law leaves.
    in_one_product : bool
        Whether its coefficient may be known only as a product with the other numbers: then an
        interval of it that reaches where physics does not is none.
    assumes : mapping of str to str
        Numbers that are known only for another one that is assumed, and why that is so.
    as_product : str
        Why the twin has other numbers than the form, of which only a product is known; empty where
        the twin's are as well known as the form's.
    told_apart_by : str
        The number that, where it is known, tells apart what else is known as that product only.
    """

    effect: str
    name: str
    linear: tuple[str, ...]
    columns: Columns
    nonlinear: tuple[str, ...] = ()
    grid: Grid = _no_grid
    signs: tuple[int, ...] = ()
    highest: tuple[float, ...] = ()
    needs: tuple[str, ...] = ()
    at_edges: bool = False
    refine: bool = True
    together: bool = False
    step: Callable[[Scene], Point] | None = None
    to_twin: ToTwin = _as_named
    limits: Callable[[Scene], Sequence[tuple[float, float]]] | None = None
    point_of: Callable[[Floats], Point] | None = None
    borne: Callable[[Scene, Point, Floats], bool] | None = None
    contains: tuple[str, ...] = ()
    refines: tuple[str, ...] = ()
    more_usual: tuple[str, ...] = ()
    rests_on_numbers: bool = False
    same_beside: Callable[[Scene, Scene, Point], Point] | None = None
    elsewhere: Callable[[Scene, Point, bool], Sequence[Point]] | None = None
    typical: Point = ()
    once_known: Callable[[Scene, Point], Sequence[Point]] | None = None
    uneven: Mapping[str, str] = field(default_factory=dict, hash=False)
    from_residual: bool = False
    is_a_mean: Callable[[Point], bool] | None = None
    roughly: Mapping[str, float] = field(default_factory=dict, hash=False)
    beyond: Callable[[Scene, Point], Mapping[str, str]] | None = None
    kinds: tuple[str, ...] = ()
    catch_all: bool = False
    only_clearly: bool = False
    rivals_none: bool = False
    in_one_product: bool = False
    assumes: Mapping[str, str] = field(default_factory=dict, hash=False)
    as_product: str = ""
    told_apart_by: str = ""

    @property
    def size(self) -> int:
        """Return the number of free numbers."""
        return len(self.linear) + len(self.nonlinear)

    def known_as_product(self, numbers: Mapping[str, Parameter]) -> str:
        """Return why the twin's numbers are known as a product only; empty where they are not."""
        apart = self.told_apart_by and numbers[self.told_apart_by].identified
        return "" if apart else self.as_product

    def carried_over(self, before: Scene, now: Scene, point: Point) -> Point:
        """Return the point of the same law beside the numbers that the twin has now."""
        return point if self.same_beside is None else self.same_beside(before, now, point)

    def refined_by(self, other: Form) -> bool:
        """Return whether another form is the same effect's, and has this one as a special case."""
        return self.effect == other.effect and self.name in other.refines

    def less_usual_than(self, other: Form) -> bool:
        """Return whether another form is the same effect's, and stands on a tie with this one."""
        return self.effect == other.effect and other.name in self.more_usual

    def allows(self, coefficients: Floats) -> bool:
        """Return whether no coefficient, shape (k,), has an impossible sign or size."""
        return all(self.sign(i) * value >= 0.0 for i, value in enumerate(coefficients)) and all(
            abs(value) <= top for value, top in zip(coefficients, self.highest, strict=False)
        )

    def is_borne(self, scene: Scene, point: Point, coefficients: Floats) -> bool:
        """Return whether the joint could have the law at a point, coefficients of shape (k,)."""
        return self.borne is None or self.borne(scene, point, coefficients)

    def sign(self, index: int) -> int:
        """Return 1 where a coefficient must not be negative, else 0."""
        return self.signs[index] if self.signs else 0
