"""From a template to a page: the one Jinja environment of all reports."""

from __future__ import annotations

from importlib import resources

from agent.numbers import dates_unbroken


def render(template: str, /, **values: object) -> str:
    """Return a page as text; every value is escaped, a missing one is an error.

    Parameters
    ----------
    template : str
        File name in ``agent/report/templates``.
    **values
        What the template shows.
    """
    import jinja2

    templates = resources.files("agent.report") / "templates"
    environment = jinja2.Environment(
        loader=jinja2.FunctionLoader(lambda name: (templates / name).read_text(encoding="utf-8")),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return dates_unbroken(environment.get_template(template).render(values))
