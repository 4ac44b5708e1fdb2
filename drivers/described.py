"""Descriptions in TOML: read whole or refused whole, with every mistake named at once.

Cells, drive profiles, register maps and the night's file are read by these functions; a `Shelf`
holds those that come with the product and takes one from a file as well.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any, Generic, TypeVar

from pydantic import BaseModel, ValidationError

from drivers.errors import why_unreadable

Model = TypeVar("Model", bound=BaseModel)


def validated(
    model: type[Model],
    text: str,
    source: str,
    refusal: type[Exception],
    *,
    whole: str,
    context: dict[str, Any] | None = None,
) -> Model:
    """Return a description; what is wrong with it is said on a line for each mistake.

    Parameters
    ----------
    model : type
        What the description is.
    text : str
        TOML.
    source : str
        What the text is called in messages.
    refusal : type
        The error that is raised.
    whole : str
        What a mistake of no one key is said to be of.
    context : dict, optional
        For the model's validators.
    """
    try:
        return model.model_validate(tomllib.loads(text), context=context)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise refusal(f"{source} is not TOML: {error}.") from error
    except ValidationError as error:
        mistakes = [mistake_in_words(e, whole) for e in error.errors()]
        head = f"{source} has {len(mistakes)} mistake{'s' if len(mistakes) > 1 else ''}:"
        raise refusal("\n  - ".join([head, *mistakes])) from error


def mistake_in_words(error: Any, whole: str) -> str:
    """Return one of pydantic's errors as a line that names the key as TOML has it."""
    where = ""
    for part in error["loc"]:
        where += f"[{part + 1}]" if isinstance(part, int) else f".{part}" if where else str(part)
    if error["type"] == "extra_forbidden":
        return f"{where}: unknown key"
    if error["type"] == "missing":
        return f"{where}: is missing"
    given = error.get("input")
    shown = "" if isinstance(given, dict | list | tuple) else f" (given: {given!r})"
    message = error["msg"].removeprefix("Value error, ")
    return f"{where or whole}: {message}{shown}"


@dataclass(frozen=True)
class Shelf(Generic[Model]):
    """Descriptions of one kind: those that come with the product, and anybody's from a file.

    Parameters
    ----------
    model : type
        What each is.
    package : str
        Where the shipped ones lie.
    kind : str
        The field's word for one, such as ``register map``; its last word is the short one.
    refusal : type
        The error that is raised.
    """

    model: type[Model]
    package: str
    kind: str
    refusal: type[Exception]

    @property
    def _word(self) -> str:
        return self.kind.rpartition(" ")[2]

    def parse(self, text: str, source: str) -> Model:
        """Parse and validate one; the error names every mistake on a line of its own."""
        return validated(self.model, text, source, self.refusal, whole=f"the {self._word}")

    def shipped(self) -> tuple[str, ...]:
        """Return the names of those that come with the product."""
        names = (entry.name for entry in files(self.package).iterdir())
        return tuple(sorted(n.removesuffix(".toml") for n in names if n.endswith(".toml")))

    def load(self, name_or_path: str, folder: Path | None = None) -> Model:
        """Return a shipped one by its name, or one from a file.

        Parameters
        ----------
        name_or_path : str
            A name of `shipped`, or the path of a TOML file.
        folder : pathlib.Path, optional
            What a relative path is relative to.
        """
        if name_or_path in self.shipped():
            entry = files(self.package).joinpath(f"{name_or_path}.toml")
            source = f"the shipped {self._word} {name_or_path}"
            return self.parse(entry.read_text(encoding="utf-8"), source)
        path = Path(name_or_path) if folder is None else folder / name_or_path
        try:
            return self.parse(path.read_text(encoding="utf-8-sig"), str(path))
        except (OSError, UnicodeDecodeError) as error:
            raise self.refusal(
                f"The {self.kind} {path} cannot be read: {why_unreadable(error)}. "
                f"Shipped {self._word}s: {', '.join(self.shipped())}."
            ) from error
