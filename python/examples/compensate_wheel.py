"""Applies a small torque to wheel 1, with the wheels in the air: without compensation friction holds the wheel, with
compensation it turns.

  compensate_wheel.py [ROBOT]        put a real robot on blocks
"""

import sys

import numpy as np
import youbot

PUSH_NM = 0.05


def push(robot, compensate):
    """Returns the positions of wheel 1 over two seconds."""
    state = robot.enable()
    compensation = youbot.FrictionCompensation(1, margin=0.9)  # of wheel 1, as measured
    compensation.reset(state.position_rad[0])
    positions = np.empty(2000)
    torque_Nm = np.zeros(len(robot.names))
    for i in range(len(positions)):
        help_Nm = compensation.step(PUSH_NM, state.position_rad[0])
        torque_Nm[0] = PUSH_NM + (help_Nm if compensate else 0)
        state = robot.step(torque_Nm=torque_Nm)
        positions[i] = state.position_rad[0]
    for _ in range(1000):  # drives off; the wheel coasts for a second
        robot.disable()
    return positions


with youbot.Robot(sys.argv[1] if len(sys.argv) > 1 else "loopback", on_ground=False) as robot:
    for compensate in (False, True):
        positions = push(robot, compensate)
        print(
            f"{PUSH_NM} N·m for 2 s {'with' if compensate else 'without'} compensation: "
            f"wheel-1 turned {np.ptp(positions):.3f} rad"
        )
