"""Templates of the HTML pages."""

from __future__ import annotations

import jinja2


def template(package: str, name: str) -> jinja2.Template:
    """Load the template ``name`` from the folder ``templates`` of ``package``; it escapes.

    It may import ``table.html.j2``, which draws a `tables.Table`. Data for a script are written
    with the filter ``tojson``, which escapes what would end or hide the script.
    """
    environment = jinja2.Environment(
        loader=jinja2.ChoiceLoader(
            [
                jinja2.PackageLoader(package, "templates"),
                jinja2.PackageLoader("space_robot.analysis", "templates"),
            ]
        ),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.filters["zip"] = zip
    environment.policies["json.dumps_kwargs"] = {"separators": (",", ":"), "allow_nan": False}
    return environment.get_template(name)
