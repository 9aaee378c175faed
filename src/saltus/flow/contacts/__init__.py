"""Motions with several contacts; each holds one coordinate while it is closed and its reaction pushes."""
