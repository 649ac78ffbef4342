"""The 5-PSS/UPU: five inclined rails, five rods, and a passive UPU limb that guides the platform.

Li, Zheng, Xu, Luo, Sun: Multi-target parameters of performance optimization for 5-PSS/UPU parallel
mechanism, Journal of Zhejiang University (Engineering Science) 53(4), 2019, 654-663.
"""
