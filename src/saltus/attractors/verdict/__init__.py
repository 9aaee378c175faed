"""What a motion that has been followed long enough is: rest, periodic, quasi-periodic, chaotic or undecided."""
