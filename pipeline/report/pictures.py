"""Pictures as data URIs: figures as SVG, renders as JPEG of the width of the page."""

from __future__ import annotations

import base64
import io
from pathlib import Path

LARGEST_VECTOR = 450_000  # bytes; a larger figure is included as PNG
WIDTH = 1200  # pixels of a render
QUALITY = 86


def inline_figure(svg: Path, png: Path) -> str:
    """A figure as a data URI: its SVG, or its PNG where that is much smaller."""
    vector = svg.read_bytes()
    if len(vector) <= LARGEST_VECTOR:
        return inline_vector(vector)
    return _uri("image/png", png.read_bytes())


def inline_vector(svg: bytes) -> str:
    """SVG as a data URI."""
    return _uri("image/svg+xml", svg)


def inline_render(png: Path) -> str:
    """A render as a JPEG data URI, no wider than `WIDTH`."""
    from PIL import Image

    with Image.open(png) as picture:
        image = picture.convert("RGB")
    if image.width > WIDTH:
        image = image.resize((WIDTH, round(image.height * WIDTH / image.width)), Image.Resampling.LANCZOS)
    stream = io.BytesIO()
    image.save(stream, "JPEG", quality=QUALITY, optimize=True)
    return _uri("image/jpeg", stream.getvalue())


def _uri(kind: str, content: bytes) -> str:
    return f"data:{kind};base64,{base64.b64encode(content).decode('ascii')}"
