"""Where actors go: random walks, optimised together, checked against hard limits."""
