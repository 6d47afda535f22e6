"""Benchmarks: what the robot must show, measured over many seeds, against fixed thresholds.

``python -m benchmarks NAME`` runs one; they belong to the checkout and not to the wheel. Every
scenario is a module that lists its metrics. Judged is what the simulator says (``GroundTruth``),
never the controller's own verdict.

    scenario     metrics, scenarios, and what one trial gave
    trials       what a seed varies, and a robot under these conditions
    runner       many trials in parallel processes
    results_log  finished trials on disk, so that an interrupted run can be resumed
    report       means, worst seeds and verdicts; table and JSON
    session      what the commands share: options, progress, output
"""
