"""Numbers read off the data of Figs. 9 to 15, for their claims."""
