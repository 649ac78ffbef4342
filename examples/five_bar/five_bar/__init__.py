"""The planar five-bar (5R): two driven arms, two rods, and the tool where the rods meet."""
