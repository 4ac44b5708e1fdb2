"""What is said of one finding, in parts, so that a page can say each once, where it belongs."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Said:
    """A finding in words.

    Parameters
    ----------
    lead : str
        The sentence that is read from afar.
    place : str
        Of it, where and how much; empty where it is not said so.
    worth : str
        What it explains, where that is a sentence of its own.
    caveat : str
        What must be known beside it.
    """

    lead: str
    place: str = ""
    worth: str = ""
    caveat: str = ""

    @property
    def whole(self) -> str:
        """Return all of it."""
        return " ".join(text for text in (self.lead, self.worth, self.caveat) if text)

    def going_on(self, more: str) -> Said:
        """Return it with something more before the full stop of what it explains."""
        lead, worth = self.lead, self.worth
        if worth:
            worth = f"{worth.removesuffix('.')}{more}."
        else:
            lead = f"{lead.removesuffix('.')}{more}."
        return Said(lead, self.place, worth, self.caveat)
