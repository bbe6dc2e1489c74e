"""The proof in the loop: the exported C inverse drives the nonlinear HexFlex along trajectories of six coordinates."""
