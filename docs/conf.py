"""How the site is built: `make docs`.

Pages are Markdown, the reference comes from the code, the gallery from examples/.
"""

import sys
from importlib.util import find_spec
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE / "_extensions"))

import saltus  # noqa: E402

project, author, copyright = (
    "saltus",
    "The saltus developers",
    "the saltus developers, BSD-3-Clause",
)
version = release = saltus.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "sphinx_design",
    "sphinx_gallery.gen_gallery",
    "saltus_reference",  # docs/_extensions
    "living_pages",
]
exclude_patterns = [
    "_build",
    "gallery/*.ipynb",
    "gallery/*.py",
    "gallery/*.md5",
    "gallery/*.json",
    "_extensions",
]
default_role = "code"  # docstrings write `name` for code
nitpicky = True
# What others define has no page here, and type variables none anywhere; every name of saltus is
# looked up.
nitpick_ignore_regex = [(r"py:.*", r"(?!saltus).*")]
suppress_warnings = ["config.cache"]

myst_enable_extensions = ["colon_fence", "dollarmath", "attrs_inline"]
myst_heading_anchors = 3
copybutton_exclude = ".linenos, .gp, .go"

autosummary_generate = False  # the pages of the reference are written by saltus_reference
autodoc_typehints = "signature"
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True  # as they are written: the text of a function is no expression
python_use_unqualified_type_names = True
maximum_signature_line_length = 100
toc_object_entries_show_parents = "hide"  # the contents at the right are narrow
napoleon_google_docstring = False
napoleon_use_rtype = False
# of results, whose fields are shown as arguments are
napoleon_custom_sections = [("Attributes", "params_style")]

sphinx_gallery_conf = {
    "examples_dirs": ["../examples"],
    "gallery_dirs": ["gallery"],
    "filename_pattern": r"\.py$",
    # JAX is not installed for the site
    "ignore_pattern": r"__init__\.py" if find_spec("optax") else r"__init__\.py|in_jax\.py",
    "plot_gallery": "True",
    "within_subsection_order": "gallery_order.InOrder",
    "image_scrapers": ("matplotlib",),
    "matplotlib_animations": False,
    "remove_config_comments": True,
    "show_memory": False,
    "show_signature": False,
    "download_all_examples": False,
    "abort_on_example_error": True,
    "only_warn_on_example_error": False,
    "min_reported_time": 5,
    "thumbnail_size": (580, 420),
    "write_computation_times": False,  # whose pages would load scripts from elsewhere
    "nested_sections": False,
    "reset_modules": ("gallery_order.reset",),
}

html_theme = "pydata_sphinx_theme"
html_title = f"saltus {version}"
html_static_path = ["_static"]
html_css_files = ["saltus.css"]
html_show_sourcelink = False
html_copy_source = False
html_show_search_summary = False  # a page that is opened as a file may not fetch the others
html_theme_options = {
    "navbar_align": "left",
    "show_toc_level": 2,
    "secondary_sidebar_items": ["page-toc"],
    "navbar_end": ["theme-switcher"],
    "footer_start": ["copyright"],
    "footer_end": [],
    "show_prev_next": True,
    "pygments_light_style": "a11y-high-contrast-light",
    "pygments_dark_style": "a11y-high-contrast-dark",
}
html_sidebars = {"index": [], "search": []}
