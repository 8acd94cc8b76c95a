"""Pictures as data URIs: figures as SVG, renders as JPEG of the width of the page."""

from __future__ import annotations

import base64
import io

LARGEST_VECTOR = 450_000  # bytes; a larger figure is included as PNG
WIDTH = 1200  # pixels of a render
QUALITY = 86


def inline_figure(svg: bytes, png: bytes | None) -> str:
    """A figure as a data URI: its SVG, or its PNG where that is much smaller and there is one."""
    return inline_vector(svg) if png is None or len(svg) <= LARGEST_VECTOR else _uri("image/png", png)


def inline_vector(svg: bytes) -> str:
    """SVG as a data URI."""
    return _uri("image/svg+xml", svg)


def inline_render(png: bytes) -> str:
    """A render as a JPEG data URI, no wider than `WIDTH`."""
    from PIL import Image

    with Image.open(io.BytesIO(png)) as picture:
        image = picture.convert("RGB")
    if image.width > WIDTH:
        image = image.resize((WIDTH, round(image.height * WIDTH / image.width)), Image.Resampling.LANCZOS)
    stream = io.BytesIO()
    image.save(stream, "JPEG", quality=QUALITY, optimize=True)
    return _uri("image/jpeg", stream.getvalue())


def _uri(kind: str, content: bytes) -> str:
    return f"data:{kind};base64,{base64.b64encode(content).decode('ascii')}"
