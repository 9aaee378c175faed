"""Motions with several contacts, each of which holds one coordinate while it is closed and pushed."""
