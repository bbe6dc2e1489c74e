"""Whole tasks done with flexdoce, each a folder with its README; run from the repository's root."""
