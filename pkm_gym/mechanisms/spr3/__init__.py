"""The 3-SPR: a spatial parallel mechanism with two rotations and one translation.

Mei, Gao, Tan, Wang, "Kinematic analysis of 3-SPR parallel mechanism", Transactions of the Chinese
Society for Agricultural Machinery 43(8), 2012, 215-220.
"""
