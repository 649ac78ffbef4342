"""The Diamond: a planar 2-DOF translational parallel manipulator for pick-and-place.

Zhang, Mei, Zhao, Huang, "Dynamic dimensional synthesis of a 2-DOF translational parallel
manipulator for pick-and-place operations", Journal of Tianjin University 43(8), 2010, 661-666.
"""
