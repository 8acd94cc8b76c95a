"""The documentation site: `make docs`. Warnings are errors, and nothing on a page is asked of a network."""

import sys
from pathlib import Path
from typing import Any

DOCS = Path(__file__).resolve().parent
sys.path.insert(0, str(DOCS))

from formulas import add_formulas  # noqa: E402
from site_text import commands_text, examples_text, short_signature, with_contents  # noqa: E402

project = "shroud"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
root_doc = "index"
exclude_patterns = ["images/*"]
needs_sphinx = "9.0"

myst_heading_anchors = 4
myst_enable_extensions = ["deflist", "dollarmath"]
myst_fence_as_directive = ["math"]  # ```math, as GitHub writes a formula of its own line

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_preserve_defaults = True
default_role = "code"

# Docstrings are numpydoc. Types in them are words, shapes and units, not references: parameters become plain lists.
napoleon_google_docstring = False
napoleon_numpy_docstring = True
napoleon_use_param = False
napoleon_use_rtype = False
napoleon_attr_annotations = False
napoleon_custom_sections = [("Attributes", "params_style")]

add_module_names = False
toc_object_entries_show_parents = "hide"
maximum_signature_line_length = 88
highlight_language = "text"

html_theme = "furo"
html_title = "shroud"
html_show_sphinx = False
html_copy_source = False
html_static_path = ["_static"]
html_css_files = ["site.css"]


def process_signature(
    app: Any, what: str, name: str, item: Any, options: Any, signature: str | None, returns: str | None
) -> tuple[str | None, str | None]:
    """Signatures with short names of the array types."""
    return short_signature(signature), short_signature(returns)


def read_source(app: Any, name: str, content: list[str]) -> None:
    """Text of the program on the page of the commands, scripts on that of the examples, a list on long ones."""
    content[0] = content[0].replace("<!-- commands -->", commands_text() if name == "command_line" else "")
    content[0] = content[0].replace("<!-- examples -->", examples_text() if name == "examples" else "")
    content[0] = content[0] if name.startswith("api/") else with_contents(content[0])


def setup(app: Any) -> None:
    """Called by Sphinx."""
    app.connect("autodoc-process-signature", process_signature)
    app.connect("source-read", read_source)
    add_formulas(app)
