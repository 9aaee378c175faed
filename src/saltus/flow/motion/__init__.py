"""One motion: the request, the loop that records it, the motion with its events, its derivatives
and its dataset.
"""
