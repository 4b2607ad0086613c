"""Environment of the HTML templates, of reports and of notebooks."""

from jinja2 import Environment, PackageLoader, StrictUndefined

from spherical_wrist.plain_text import visible


def template_environment(package: str) -> Environment:
    """Return the environment of the folder ``templates`` in a package of ours; all that is put into them is escaped.

    Args:
        package: dotted name of the package.
    """
    return Environment(
        loader=PackageLoader(package),
        autoescape=True,
        finalize=lambda value: visible(value) if isinstance(value, str) else value,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
