"""Dakota both ways: input files of a study, the analysis driver, and Dakota's results read back."""
