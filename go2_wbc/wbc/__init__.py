"""The whole-body controller: tasks, constraints, the QP and its back ends."""
