"""Body models, and how a room's people are drawn and put in motion."""
