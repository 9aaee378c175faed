"""Many exact trajectories at once, one in each lane of the machine's vector registers, on all
cores.
"""
