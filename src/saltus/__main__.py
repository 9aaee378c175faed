"""`python -m saltus` is the command `saltus`."""

from saltus.cli import main

main()
