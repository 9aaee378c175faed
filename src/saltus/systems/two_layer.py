"""The two-degree-of-freedom metainterface (paper, `eomnl`)."""

from __future__ import annotations

from saltus.systems.model import Model


class TwoLayer(Model):
    """Placeholder until written."""
