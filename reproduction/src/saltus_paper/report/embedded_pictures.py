"""Pictures as text within the report, so that it is one file: losslessly packed, at their full
size.
"""

from __future__ import annotations

import base64
import io
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True, kw_only=True)
class EmbeddedPicture:
    """A picture in the form in which an HTML page contains it."""

    uri: str
    width: int  # in pixels
    height: int


def embedded(path: Path) -> EmbeddedPicture:
    """A PNG file as lossless WebP, two fifths of its size, or as it is where Pillow lacks WebP."""
    from PIL import Image, features

    buffer = io.BytesIO()
    with Image.open(path) as picture:
        width, height = picture.size
        kind = "webp" if features.check("webp") else "png"
        if kind == "webp":
            # The least effort would double the size, and an effort above 2 gains nothing.
            picture.convert("RGB").save(buffer, format="WEBP", lossless=True, quality=50, method=2)
    content = buffer.getvalue() or path.read_bytes()
    return EmbeddedPicture(
        uri=f"data:image/{kind};base64,{base64.b64encode(content).decode()}",
        width=width,
        height=height,
    )
