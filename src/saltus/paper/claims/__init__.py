"""The numbers and statements of the paper beside what is computed here."""
