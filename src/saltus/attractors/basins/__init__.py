"""Basins of attraction on a grid of initial states, and measures of how they interlace."""
