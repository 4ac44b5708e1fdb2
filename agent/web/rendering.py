"""From a template to an answer in the reader's language."""

from __future__ import annotations

import datetime
import functools
import importlib.resources
from collections.abc import Callable
from typing import TYPE_CHECKING

from fastapi import Request
from fastapi.responses import HTMLResponse

from agent.errors import AgentError
from agent.numbers import dates_unbroken
from agent.web.access import page_of, session_of
from agent.web.roles import Role
from agent.web.words import saying
from agent.web.words.language import LANGUAGES, fine, language_of, lasts, number, say

if TYPE_CHECKING:
    import jinja2

LANGUAGE_COOKIE = "stribeck_language"


@functools.cache
def templates() -> jinja2.Environment:
    """Return the page's templates: everything is escaped, a missing value is an error."""
    import jinja2

    folder = importlib.resources.files("agent.web") / "templates"
    return jinja2.Environment(
        loader=jinja2.FunctionLoader(lambda name: (folder / name).read_text(encoding="utf-8")),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        auto_reload=False,
    )


def render(
    request: Request, template: str, /, *, status: int = 200, **values: object
) -> HTMLResponse:
    """Return a page.

    Parameters
    ----------
    request : Request
        Says who reads it, and in which language.
    template : str
        File name in ``agent/web/templates``.
    status : int
        HTTP's.
    **values
        What the template shows.
    """
    page = page_of(request)
    session = session_of(request)
    who = None if session is None or session.locked else session
    language = chosen_language(request)
    try:
        robot = page.cell.robot
    except AgentError:
        robot = ""
    text = (
        templates()
        .get_template(template)
        .render(
            {
                **voice(language),
                "language": language,
                "languages": LANGUAGES,
                "path": request.url.path,
                "robot": robot,
                "who": who,
                "may": lambda word: who is not None and who.role >= Role.of(word),
                "csrf": "" if who is None else who.csrf,
                "running": page.attendant.active is not None or bool(page.elsewhere()),
                "status": status,
                **values,
            }
        )
    )
    text = dates_unbroken(text)
    return HTMLResponse(text, status, headers={"content-language": language, "vary": "Cookie"})


def chosen_language(request: Request) -> str:
    """Return the reader's language: as chosen, else as the browser asks."""
    return language_of(
        request.cookies.get(LANGUAGE_COOKIE, ""), request.headers.get("accept-language", "")
    )


def voice(language: str) -> dict[str, Callable[..., object]]:
    """Return what a template says things with: words, numbers, times, ages, what was decided."""
    return {
        "t": functools.partial(say, language),
        "num": functools.partial(number, language),
        "fine": functools.partial(fine, language),
        "lasts": functools.partial(lasts, language),
        "when": functools.partial(when, language),
        "ago": functools.partial(ago, language),
        "verdict_said": functools.partial(saying.verdict, language),
        "steps_said": functools.partial(saying.steps, language),
        "reasons_said": functools.partial(saying.reasons, language),
        "advice_said": functools.partial(saying.advice, language),
        "refusal_said": functools.partial(saying.refusal, language),
    }


def when(language: str, text: str, *, day: bool = False) -> str:
    """Return a label of ISO 8601 as people write it, in this machine's time zone.

    What is no time is returned as it is.
    """
    try:
        moment = datetime.datetime.fromisoformat(text).astimezone()
    except (ValueError, OverflowError, OSError):
        return text
    date = f"{moment:%d.%m.%Y}" if language == "de" else f"{moment:%Y-%m-%d}"
    return date if day else f"{date} {moment:%H:%M}"


def ago(language: str, days: float | None) -> str:
    """Return how long ago something was."""
    if days is None:
        return say(language, "never")
    minutes = max(0.0, days) * 1440.0
    if minutes < 1.0:
        return say(language, "just_now")
    if minutes < 90.0:
        return say(language, "ago_minutes", n=round(minutes))
    if minutes < 2160.0:
        return say(language, "ago_hours", n=round(minutes / 60.0))
    return say(language, "ago_days", n=round(days))
