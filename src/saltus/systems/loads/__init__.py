"""Loads: channels, signals, pulses, and what repeats."""
