"""What the kernels of all models share: roots, steps and the layout of their memory."""
