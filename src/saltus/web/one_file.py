"""One HTML file of all that a page needs: markup, style, modules, the description of a system and
its compiled code.
"""

from __future__ import annotations

import base64
import gzip
import hashlib
import html
import json
import re
from collections.abc import Mapping
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

PAGE = Path(__file__).parent / "page"  # the page's own sources
# unpacks the joined modules, which are a fifth as long when packed, and runs them
LOADER = (PAGE / "loader.js").read_text()
IMPORT = re.compile(r'^import \{([^}]*)\} from "\./([\w]+)\.js";\n', re.MULTILINE)
EXPORT = re.compile(r"^export (?:async )?(?:function|class|const) (\w+)", re.MULTILINE)
COMMENT = re.compile(r"[ \t]*/\*\*.*?\*/\n?", re.DOTALL)
# lines of comments, indents, comments behind code
LINE = re.compile(r"^\s*//.*\n|^[ \t]+|(?<=[;,{]) // .*$", re.MULTILINE)


def one_file(description: Mapping[str, Any], wasm: bytes, *, entry: Path = PAGE / "boot.js") -> str:
    """The page of a system as one HTML text, which needs no other file and connects to nothing.

    Parameters
    ----------
    description
        What `engine.js` and the page are told of the system; it is put in as JSON, so that no text
        of a study is markup.
    wasm
        The compiled code of the system's kernel and model.
    entry
        The module with which the page begins.
    """
    script = joined(entry)
    style = (PAGE / "page.css").read_text()
    worker = joined(PAGE / "worker.js") if (PAGE / "worker.js").exists() else ""
    parts = {
        "policy": _policy(LOADER, style),
        "version": html.escape(metadata.version("saltus")),
        "title": html.escape(str(description.get("title") or description["model"]["name"])),
        "style": style,
        "description": json.dumps(description, allow_nan=False).replace("<", "\\u003c"),
        "wasm": _packed(wasm),
        "worker": _packed(worker.encode()),
        "script": _packed(script.encode()),
        "loader": LOADER,
    }
    return re.sub(r"\{\{(\w+)\}\}", lambda found: parts[found[1]], (PAGE / "page.html").read_text())


@cache
def joined(entry: Path) -> str:
    """A module with all that it imports as one text: each module a function that returns what it
    exports, in their order.
    """
    texts: dict[Path, str] = {}
    _collect(entry, texts, ())
    text = "\n".join(_wrapped(path, source) for path, source in texts.items())
    if re.search("</script|<!--", text, re.IGNORECASE):
        raise ValueError(
            f"{entry.name}: a module must not contain the end of its own script element"
        )
    return text


def _collect(path: Path, texts: dict[Path, str], above: tuple[Path, ...]) -> None:
    if path in above:
        raise ValueError(
            f"{path.name} imports itself through {', '.join(each.name for each in above)}"
        )
    if path in texts:
        return
    source = LINE.sub("", COMMENT.sub("", path.read_text()))
    for _, name in IMPORT.findall(source):
        _collect(_beside(path, name), texts, (*above, path))
    texts[path] = source


def _beside(path: Path, name: str) -> Path:
    """A module of that name beside another one, or among the page's sources."""
    near = path.parent / f"{name}.js"
    return near if near.exists() else PAGE / f"{name}.js"


def _wrapped(path: Path, source: str) -> str:
    body = IMPORT.sub(
        lambda found: f"const {{{' '.join(found[1].split())}}} = module_{found[2]};\n", source
    )
    if re.search(r"^import\b|^export (?:default|\{|\*)", body, re.MULTILINE):
        raise ValueError(
            f"{path.name}: only `import {{ names }} from './module.js'` and exported declarations"
            " can be joined"
        )
    names = EXPORT.findall(body)
    body = re.sub(r"^export (?!\{)", "", body, flags=re.MULTILINE)
    return (
        f"const module_{path.stem} = (() => {{\n{body.strip()}\nreturn"
        f" {{{', '.join(names)}}};\n}})();"
    )


def _packed(content: bytes) -> str:
    return base64.b64encode(gzip.compress(content, 9, mtime=0)).decode()


def _policy(script: str, style: str) -> str:
    """What the page may do: run its own script and style, what it has unpacked, compile its own
    code, and start workers.
    """
    own = {name: _hash(text) for name, text in (("script", script), ("style", style))}
    return (
        f"default-src 'none'; script-src {own['script']} blob: 'wasm-unsafe-eval'; style-src"
        f" {own['style']}; worker-src blob:; img-src data: blob:; base-uri 'none'; form-action"
        " 'none'"
    )


def _hash(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"
