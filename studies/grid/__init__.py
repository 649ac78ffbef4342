"""Grids of designs: the paper's and ours, as an atlas and as a study."""
