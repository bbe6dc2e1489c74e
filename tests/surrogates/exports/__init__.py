"""Exports against the model that they were made from."""
