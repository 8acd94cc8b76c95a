"""Formulas of the pages as MathML, made while the site is built: a browser shows them without script or network."""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.util import logging

_LOG = logging.getLogger(__name__)
_WITHOUT_BRACES = re.compile(r"\\[dt]?frac(?![{a-zA-Z])")  # read as 12 over what follows: \frac12


def mathml(latex: str, block: bool) -> str:
    """MathML of a LaTeX formula. Raises ValueError where it is not understood."""
    if _WITHOUT_BRACES.search(latex):
        raise ValueError(f"formula not understood: {latex}: write \\frac with braces")
    try:
        return str(tex2mathml(latex, as_block=block))
    except (MathError, SyntaxError) as error:
        raise ValueError(f"formula not understood: {latex}: {error}") from error


def _written(translator: Any, node: nodes.Element, block: bool) -> None:
    try:
        text = mathml(node.astext(), block)
    except ValueError as error:
        _LOG.warning("%s", error, location=node)
        text = translator.encode(node.astext())
    translator.body.append(f'<div class="formula">{text}</div>\n' if block else text)
    raise nodes.SkipNode


def add_formulas(app: Any) -> None:
    """Register the renderer with Sphinx and choose it."""

    def inline(translator: Any, node: nodes.Element) -> None:
        _written(translator, node, block=False)

    def block(translator: Any, node: nodes.Element) -> None:
        _written(translator, node, block=True)

    app.add_html_math_renderer("mathml", inline_renderers=(inline, None), block_renderers=(block, None))
    app.config.html_math_renderer = "mathml"
