"""Plug-ins for Perpetua: halls with columns, people who look at the floor, tracks as a table."""
