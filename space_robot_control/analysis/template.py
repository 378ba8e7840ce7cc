"""Templates of the HTML pages."""

from __future__ import annotations

import jinja2


def template(package: str, name: str) -> jinja2.Template:
    """The template ``name`` in the folder ``templates`` of ``package``; it escapes."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader(package, "templates"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    return environment.get_template(name)
