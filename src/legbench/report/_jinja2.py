"""Import of jinja2, an optional dependency: the one door to it."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from legbench.errors import MissingExtraError

try:
    import jinja2
    from markupsafe import Markup, escape
except ImportError as error:
    raise MissingExtraError(
        "jinja2 is not installed; a report needs it: pip install 'legbench[report]'"
    ) from error

TEMPLATES: Final = Path(__file__).with_name("templates")


def render(template: str, context: Mapping[str, Any]) -> str:
    """Fill a template of this room; every text is escaped unless it is an SVG of our own.

    Args:
        template: file name of the template.
        context: values by name; one that the template misses is an error.
    """
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["rated"] = rated
    environment.filters["svg"] = Markup
    return environment.get_template(template).render(context)


def rated(text: str) -> Markup:
    """A text whose P^r is set as a symbol with its exponent."""
    return Markup(str(escape(text)).replace("P^r", "<i>P</i><sup>r</sup>"))
