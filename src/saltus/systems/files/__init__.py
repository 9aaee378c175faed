"""Files of matrices and of records, read into numbers."""
