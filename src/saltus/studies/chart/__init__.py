"""Stability charts: the stable motions beside rest in the plane of two parameters, with exact
borders.

`chart_study.py` has the functions for users, also those that check charts by other means, and
`chart_request.py` what is asked for. `cells.py` computes the cells of a block of the plane,
`motions.py` is the record of a stable motion that all files share. `changes.py` finds what becomes
of one that the neighbouring cell lacks; `borders.py` follows its end as a curve through the plane,
by `border_work.py`.
"""
