"""From motions to orbits: a motion that has settled is solved as an orbit, and orbits are searched
for from many states.
"""
