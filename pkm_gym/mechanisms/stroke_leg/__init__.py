"""The stroke-amplification leg of a quadruped: two cylinders, two cranks, a double rhombus.

Wang, Jin, Li: Optimization design of structural parameters of 2-DOF parallel stroke amplification
mechanism, Optics and Precision Engineering 27(5), 2019, 1148-1157.
"""
