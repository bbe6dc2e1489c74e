"""Proof that an export is the model it was made from: each target in its own language, at the same points."""
