"""Where motions lead: recurrence, the orbit that a motion approaches, and releases from rest by the
load.
"""
