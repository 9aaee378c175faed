"""What all tests of the reproduction share: the settings of those of saltus, and the command line."""

from command_line import refused, saltus, started

__all__ = ["refused", "saltus", "started"]
