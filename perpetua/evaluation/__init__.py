"""Scores of predicted tracks against finished sequences, and simple trackers to compare with."""
