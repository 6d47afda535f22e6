"""The motors: what they can give at a speed, and what they give for a command.

``robot.motor.MotorModel`` says what is computed here and where its numbers come from.
"""

from __future__ import annotations

from go2_wbc.kernels.compilation import kernel, subroutine


@subroutine("f8(f8, f8, f8, f8)")
def available(v, peak, knee_speed, no_load_speed):
    """Greatest torque at velocity v; the least one is -available(-v)."""
    if not v > knee_speed:
        return peak
    return peak * max(1.0 - (v - knee_speed) / (no_load_speed - knee_speed), 0.0)


_NUMBERS = "Array(f8, 1, 'A', readonly=True)"


@kernel(f"void({_NUMBERS}, {_NUMBERS}, {_NUMBERS}, f8[:,::1], f8[:,::1])")
def note_peaks(tau, v, v_before, motor, peaks):
    """Raise ``peaks`` (3, 12) to |tau|, |v| and the share of the line that ``tau`` was.

    ``tau`` acted from ``v_before`` on; ``motor`` (4, 12) holds the fields of a ``MotorModel`` and
    the least torque that counts as available.
    """
    for n in range(12):
        speed = v_before[n] if tau[n] >= 0.0 else -v_before[n]
        most = available(speed, motor[0, n], motor[1, n], motor[2, n])
        peaks[0, n] = max(peaks[0, n], abs(tau[n]))
        peaks[1, n] = max(peaks[1, n], abs(v[n]))
        peaks[2, n] = max(peaks[2, n], abs(tau[n]) / max(most, motor[3, n]))


@kernel("void(f8[:,::1], f8[:,::1], i8[:,::1], f8[::1], f8[::1], f8[::1], f8[::1])")
def drive(command, motor, places, qpos, qvel, ctrl, total):
    """``MotorModel.torque`` now, into ctrl, and added to ``total`` (12,).

    ``command`` (5, 12) holds tau, q_des, v_des, kp and kd; ``motor`` (3, 12) the fields of a
    ``MotorModel``; ``places`` (3, 12) where each joint's angle, velocity and control are.
    """
    for n in range(12):
        q, v = qpos[places[0, n]], qvel[places[1, n]]
        tau = command[3, n] * (command[1, n] - q) + command[0, n]
        tau += command[4, n] * (command[2, n] - v)
        tau = min(tau, available(v, motor[0, n], motor[1, n], motor[2, n]))
        tau = max(tau, -available(-v, motor[0, n], motor[1, n], motor[2, n]))
        ctrl[places[2, n]] = tau
        total[n] += tau
