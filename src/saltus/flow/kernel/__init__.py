"""What the kernels of all models share: roots, steps, the layout of their memory, and how they are
compiled.
"""
