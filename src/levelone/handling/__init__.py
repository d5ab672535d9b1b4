"""Manoeuvres, time histories and frequency responses; handling-qualities criteria, one a file; Levels as data."""
