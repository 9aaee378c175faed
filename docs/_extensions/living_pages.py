"""Pages that compute, in the pages of this site: each is made when the site is built, and stands
beside it as a file.
"""

from pathlib import Path

from docutils import nodes
from docutils.parsers.rst import Directive
from living_systems import PAGES, write

FOLDER = "living"  # in the folder of the site


class LivingPage(Directive):
    """`{living-page} name`: one of the pages in a frame, and a link to it alone."""

    required_arguments = 1

    def run(self):
        """The frame as HTML; in other formats there is nothing."""
        name = self.arguments[0]
        if name not in PAGES:
            raise self.error(f"there is no living page {name!r}: {', '.join(PAGES)}")
        environment = self.state.document.settings.env
        address = f"{'../' * environment.docname.count('/')}{FOLDER}/{name}.html"
        title = PAGES[name].__doc__.splitlines()[0]
        frame = f'<iframe class="living" src="{address}" title="{title}" loading="lazy"></iframe>'
        alone = f'<p class="living-alone"><a href="{address}">Open this page alone</a></p>'
        return [nodes.raw("", frame + alone, format="html")]


def write_all(application, error):
    """Write the pages beside the site, once it is there."""
    if error is None and application.builder.name == "html":
        for name in PAGES:
            write(name, Path(application.outdir) / FOLDER)


def setup(application):
    """Called by Sphinx."""
    application.add_directive("living-page", LivingPage)
    application.connect("build-finished", write_all)
    return {"parallel_read_safe": True}
