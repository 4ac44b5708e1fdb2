"""What is told of a study: its findings and verdict, and what has no name and where it lies."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from agent.explain.answer.result import Explanation, Finding, Verdict
from agent.explain.carrying import Given, with_load
from agent.explain.choosing.materiality import CLOSE, MATERIAL
from agent.explain.findings import findings_of, order_of
from agent.explain.location.leftover import LeftWhere, left_where, line_regions
from agent.explain.rows.evidence import effective_size
from agent.explain.rows.scene import Scene
from agent.explain.study import Study
from agent.explain.surroundings import (
    beside_the_joint,
    not_needed,
    of_its_loop,
    of_the_simulation,
    simulations_sentence,
    swing_sentence,
    verdict_beside,
)
from agent.explain.unnamed import may_be_the_unnamed, own_numbers, sure_waves, unnamed
from agent.explain.verdict import SHOWN, left_share, verdict_of

_ALL, _MOST = 0.9, 0.5  # of the mismatch


@dataclass(frozen=True)
class Told:
    """A study and what is told of it.

    `named` are its findings, `findings` those with loads, `swings` what swings beside the joint
    and has no name, and `simulations` what swings in a recorded simulation alone.
    """

    found: Study
    named: tuple[Finding, ...]
    findings: tuple[Finding, ...]
    verdict: Verdict
    swings: tuple[Finding, ...] = ()
    simulations: tuple[Finding, ...] = ()

    @classmethod
    def of(cls, found: Study, given: Given) -> Told:
        """Return what is told of a study."""
        named = findings_of(found)
        told = cls(found, named, with_load(named, found, given), "unexplained").judged_again()
        if told.verdict == "partly-explained" and may_be_the_unnamed(found.library, found.model):
            return replace(told, verdict="unexplained")
        scene = found.library.scene
        simulations = of_the_simulation(found.library, found.choice, named)
        light = beside_the_joint(scene, named)
        swings = (*light, *(f for f in not_needed(scene, named) if f not in light))
        swings = tuple(swing for swing in swings if swing not in simulations)
        if told.verdict == "unexplained":  # what explains too little shows no swing
            swings = ()
        if not swings and not simulations:
            return told
        nameless = (*swings, *simulations, *of_its_loop(named, simulations))
        kept = [f for f in named if f not in nameless]
        most = 1.0 - left_share(found, named)  # what is left over is nobody's
        simulations = tuple(_at_most(most, simulations))
        named = tuple(replace(f, rank=rank) for rank, f in enumerate(kept, start=1))
        return cls(
            found, named, with_load(named, found, given), told.verdict, swings, simulations
        ).judged_again()

    def without_names(self, given: Given) -> Told:
        """Return what is told where no law is named beside what the signals show themselves.

        What they show explains a part, however small; and so does a wave that is surely there.
        """
        waves = sure_waves(self.found)
        shown, found = SHOWN | waves, unnamed(self.found, waves)
        kept = [f for f in self.named if f.effect in own_numbers(found) | shown]
        kept = _said_alone(kept, findings_of(found), found.library.scene) if waves else kept
        named = tuple(replace(f, rank=rank) for rank, f in enumerate(kept, start=1))
        verdict = "partly-explained" if any(f.effect in shown for f in named) else self.verdict
        return replace(
            self, found=found, named=named, findings=with_load(named, found, given), verdict=verdict
        )

    def taken_back(self, given: Given) -> Told:
        """Return what is told where unseen recordings deny the laws, judged by what is left.

        What had no name beside them is no noise without them.
        """
        told = self.without_names(given)
        denied = self.verdict == "partly-explained"
        return replace(told, found=replace(told.found, denied=denied)).judged_again()

    def judged_again(self) -> Told:
        """Return the same with the verdict that these findings have."""
        verdict = verdict_of(self.found, self.findings, left_share(self.found, self.findings))
        if self.simulations and not self.findings:
            return replace(self, verdict="unexplained")
        return replace(self, verdict=verdict_beside(verdict, self.findings, self.swings))

    def beside_a_rival(self) -> Told:
        """Return the same where something without a name of its own is as likely as all of it."""
        return replace(self, findings=tuple(_halved(f) for f in self.findings))

    def left_share(self) -> float:
        """Return which share of the mismatch has no name."""
        left = left_share(self.found, self.findings)
        return min(left + sum(s.energy_share for s in self._modelled()), 1.0)

    def left_where(self) -> LeftWhere:
        """Return where that lies, and what would have to vary there."""
        own = tuple(region for swing in self.swings for region in swing.where)
        left = _left_where(self.found)
        return replace(left, regions=(*own, *left.regions))

    def swings_said(self) -> tuple[str, ...]:
        """Return what is said of the swings."""
        kept, scene = self._modelled(), self.found.library.scene
        held = "; twin.toml holds it as a spring, so that the numbers beside it are right"
        swings = (f"{swing_sentence(s, scene)}{held if s in kept else ''}" for s in self.swings)
        own = (
            simulations_sentence(own, self.findings)
            for own in self.simulations
            if own.energy_share >= MATERIAL
        )
        return (*own, *swings)

    def all_the_simulations(self, answer: Explanation) -> Explanation:
        """Return an answer that begins with what is the simulation's own, where that is most."""
        share = sum(s.energy_share for s in self.simulations)
        if self.findings or not share > _MOST:
            return answer
        own = simulations_sentence(self.simulations[0], self.findings)
        sentence = f"No physics of the joint is missing that these recordings show. {own}."
        if share <= _ALL:
            much, why = own.split(": ", 1)
            rest = "The rest has no name in the library."
            sentence = f"{much}. {why[0].upper()}{why[1:]}. {rest}"
        return replace(
            answer, sentence=sentence, reasons=tuple(r for r in answer.reasons if r != own)
        )

    def _modelled(self) -> tuple[Finding, ...]:
        """Return the swings that the study's model still holds."""
        effects = {term.scored.form.effect for term in self.found.choice.terms}
        return tuple(swing for swing in self.swings if swing.effect in effects)


def _said_alone(kept: Sequence[Finding], alone: Sequence[Finding], scene: Scene) -> list[Finding]:
    """Return findings with what is said of them beside each other alone.

    Their numbers stay as wide as what has no name leaves them.
    """
    said = {(f.effect, f.form, order_of(scene, f.parameters)): f for f in alone}
    pairs = ((f, said.get((f.effect, f.form, order_of(scene, f.parameters)), f)) for f in kept)
    return [replace(f, said=now.said, energy_share=now.energy_share) for f, now in pairs]


def _halved(finding: Finding) -> Finding:
    """Return a finding as likely, with its rivals, as what may stand in the place of all."""
    rivals = (replace(a, probability=0.5 * a.probability) for a in finding.alternatives)
    return replace(finding, probability=0.5 * finding.probability, alternatives=tuple(rivals))


def _at_most(most: float, findings: Sequence[Finding]) -> Iterator[Finding]:
    """Yield findings with shares that add up to no more than so much of the mismatch."""
    whole = max(sum(f.energy_share for f in findings), 1e-300)
    for finding in findings:
        yield replace(finding, energy_share=finding.energy_share * min(most / whole, 1.0))


def _left_where(found: Study) -> LeftWhere:
    """Return where what is left lies; nowhere where it is noise."""
    lines = line_regions(found.lines)
    if found.left.ratio <= CLOSE:
        return LeftWhere(lines)
    library = found.library
    rows, weight = library.weighing.rows, library.weighing.weight
    left = found.model.residual_nm
    size = effective_size(found.table, library.weighing, left * weight)
    cells = tuple(cell for cell in found.left_cells if cell.counts)
    own = left_where(library.scene, rows, left, found.left.noise_nm, size / rows.shape[0], cells)
    return replace(own, regions=(*lines, *own.regions))
