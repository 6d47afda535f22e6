"""Unitree's own protocol (DDS): their ``SportClient`` moves our robot, our controller their robot.

Only ``bus.py`` and ``idl.py`` import the DDS library, and they are imported by what needs them.
"""
