"""The behaviour bench: what the robot must show, measured over many seeds, against fixed bars.

Every module but the ones below measures one part and lists its rows. The truth comes from the
simulator (``GroundTruth``), never from the controller's own verdict.

    trials    what a seed varies, and how a robot is set up for one
    truth   what MuJoCo says after every tick
    rows      rows, families of rows, and what a trial gave
    families  all families, in the order of the report
    runner    many trials in parallel processes
    report    means, worst seeds and verdicts; table and JSON
"""
