"""What the numbers were measured on."""

from __future__ import annotations

import datetime
import os
import platform
from collections.abc import Iterable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from saltus import __version__

VECTORS = ("avx512f", "avx2", "asimd", "sse2")


def about(packages: Iterable[str], **settings: Any) -> dict[str, Any]:
    """Machine, versions and settings, for the head of the report."""
    return {
        "processor": _processor(),
        "cores": os.cpu_count(),
        "widest vectors": next(
            (name for name in VECTORS if name in _cpuinfo("flags", "Features").split()), "unknown"
        ),
        "load average at the start": ", ".join(f"{x:.2f}" for x in os.getloadavg())
        if hasattr(os, "getloadavg")
        else "unknown",
        "system": f"{platform.system()} {platform.release()}",
        "Python": platform.python_version(),
        "versions": ", ".join(f"{p} {_version(p)}" for p in dict.fromkeys(packages)),
        "date": datetime.datetime.now(datetime.UTC).date().isoformat(),
        **settings,
    }


def _cpuinfo(*keys: str) -> str:
    path = Path("/proc/cpuinfo")
    lines = path.read_text().splitlines() if path.exists() else []
    return next(
        (line.split(":", 1)[1].strip() for line in lines if line.split(":")[0].strip() in keys), ""
    )


def _processor() -> str:
    return _cpuinfo("model name") or platform.processor() or platform.machine()


def _version(package: str) -> str:
    try:
        # a checkout's own, not that of its last installation
        return __version__ if package == "saltus" else version(package)
    except PackageNotFoundError:
        return "(not installed)"
