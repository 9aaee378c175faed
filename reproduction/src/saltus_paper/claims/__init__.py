"""The numbers and statements of the paper, and how they are judged by what is computed here."""
