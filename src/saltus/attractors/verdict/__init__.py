"""Verdicts: what one motion ends on, with the evidence.

`classification` asks, `verdict` judges a motion that rests, repeats itself or has ended, and `nonsettling` one that does neither:
by its exponents, by `zero_one_test` and by `tori`, which excludes quasi-periodic motion; `reason` holds the sentences.
"""
