"""Ensembles on a card: the lanes' own driver, for one lane in each of the card's threads.

There is no second step and no second rule for events. `thread.py` is the driver's entry for one
motion; its text, that of the driver, of the scalar kernel and of the structure's functions is the
one of the lanes, written for a width of one (`kernel_text.py`). `thread_code.py` links it with the
memory of a thread and compiles it for a target: a card, or this processor, on which tests follow the
same text. `launch.py` runs it, part by part, and gives back what `Lanes.run` gives.
"""
