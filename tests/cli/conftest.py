"""The command line, run in this process and in one of its own."""

from command_line import refused, saltus, started

__all__ = ["refused", "saltus", "started"]
