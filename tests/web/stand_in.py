"""Descriptions of systems for tests of the page alone, with a plain integrator in the place of the
engine.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from saltus.web.one_file import one_file

HERE = Path(__file__).parent


def number(path: str, value: float, low: float, high: float, **more: Any) -> dict[str, Any]:
    return {
        "path": path,
        "unit": "rad" if more.get("angle") else "1",
        "value": value,
        "low": low,
        "high": high,
        **more,
    }


def frequency(value: float) -> dict[str, Any]:
    return {
        "channel": "",
        "kind": "frequency",
        "parameters": [number("load.frequency", value, 0.1, 3.0)],
    }


def harmonic(channel: str, amplitude: float) -> dict[str, Any]:
    numbers = [
        number(f"load.{channel}.amplitude", amplitude, 0.0, 2.0),
        number(f"load.{channel}.mean", 0.0, -1.0, 1.0),
        number(f"load.{channel}.phase", 0.0, -math.pi, math.pi, angle=True),
    ]
    return {"channel": channel, "kind": "Harmonic", "parameters": numbers}


def wall() -> dict[str, Any]:
    """x'' + c x' + k x = F sin(Omega tau), at a wall."""
    model = {"type": "WallOscillator", "stiffness": 1.0, "damping": 0.1, "wall": 1.0}
    load = {"frequency": 0.8, "force": {"amplitude": 0.8, "mean": 0.0, "phase": 0.0, "order": 1}}
    numbers = [
        number("model.stiffness", 1.0, 0.0, 4.0),
        number("model.damping", 0.1, 0.0, 1.0),
        number("model.wall", 1.0, -2.0, 2.0),
    ]
    return {
        "version": 1,
        "title": "An oscillator at a wall",
        "model": {
            "name": "WallOscillator",
            "coordinates": [{"name": "x", "velocity": "x_velocity", "unit": "1"}],
            "parameters": numbers,
            "margins": [],
            "contacts": [{"name": "wall", "coordinate": "x", "path": "model.wall"}],
        },
        "impact": {"name": "VelocityReduction", "parameters": [number("impact.e", 0.8, 0.0, 1.0)]},
        "load": [frequency(0.8), harmonic("force", 0.8)],
        "start": {"time": 0.0, "x": 0.0, "x_velocity": 0.0},
        "study": {
            "system": {
                "model": model,
                "load": load,
                "impact": {"type": "VelocityReduction", "e": 0.8},
            },
            "simulate": {"x": 0.0, "periods": 12},
        },
        "digest": "stand-in-wall",
        "results": [],
    }


def cell() -> dict[str, Any]:
    """The metainterface under load (i) of the paper."""
    beta0 = math.radians(80)
    model = {"type": "Metainterface", "beta0": beta0, "damping": 0.1}
    load = {
        "frequency": 1.0,
        "horizontal": {"amplitude": 0.5, "mean": 0.0, "phase": 0.0, "order": 1},
        "vertical": -0.5,
    }
    numbers = [
        number("model.beta0", beta0, 0.8, 2.4, angle=True),
        number("model.damping", 0.1, 0.0, 1.0),
    ]
    vertical = {
        "channel": "vertical",
        "kind": "Constant",
        "parameters": [number("load.vertical", -0.5, -2.0, 0.5)],
    }
    return {
        "version": 1,
        "title": "The metainterface, Fig. 4",
        "model": {
            "name": "Metainterface",
            "coordinates": [{"name": "theta", "velocity": "theta_velocity", "unit": "rad"}],
            "parameters": numbers,
            "margins": [],
            "contacts": [],
        },
        "impact": {"name": "VelocityReduction", "parameters": [number("impact.e", 1.0, 0.0, 1.0)]},
        "load": [frequency(1.0), harmonic("horizontal", 0.5), vertical],
        "start": {"time": 0.0, "theta": 0.3, "theta_velocity": 0.0},
        "study": {
            "system": {
                "model": model,
                "load": load,
                "impact": {"type": "VelocityReduction", "e": 1.0},
            },
            "simulate": {"theta": 0.3, "velocity": 0.0, "periods": 20},
        },
        "digest": "stand-in-cell",
        "results": [],
    }


def page_of(description: dict[str, Any]) -> str:
    return one_file(description, b"", entry=HERE / "stand_in_boot.js")
