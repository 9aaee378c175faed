"""The page that computes: one HTML file with the kernel and a model compiled for the browser, and
its own views and controls.
"""
