"""The motion of models with one contact: an arc, an impact, rest, accumulations of impacts and
chatter.
"""
