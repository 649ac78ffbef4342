"""The 6-PUS engraving machine: six vertical screws on three columns, six hanging rods.

Zhang, Kong: A novel 6-PUS parallel engraving machine, Robot 27(4), 2005, 313-318.
"""
