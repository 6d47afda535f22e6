"""Benchmarks: what the robot must show, measured over many seeds, against fixed thresholds.

``python -m benchmarks NAME`` runs one; they belong to the checkout and not to the wheel. Each lists
its studies: metrics with their thresholds, and a trial that gives them for a seed. Judged is what
the simulator says (``GroundTruth``), never the controller's own verdict.

    study           metrics, studies, what one trial gave
    report          means, deviations, worst seeds and verdicts; table and JSON
    command         what the commands share: options, trials as rows of a sweep, output
    robots          robots on trial, what pushes them, and what is true of them
    validation_set  motions by which the feasibility check is judged, and what physics makes of them
    bridges         ROS 2 and Unitree's protocol between processes
"""
