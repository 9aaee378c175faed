"""What a model promises: with one contact, and with several."""
