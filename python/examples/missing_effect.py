"""Simulates a wheel with cogging in plain numpy, and searches for the effect that a model without cogging lacks."""

import numpy as np
import youbot

INERTIA, COULOMB, VISCOUS = 0.0112, 0.045, 0.0125
COGGING_NM, PERIODS = 0.012, 26
PERIOD_S, SUBSTEPS = 1e-3, 20


def drive(torque_Nm):
    """Returns the positions of a wheel with friction, sticking and cogging, starting from rest."""
    dt = PERIOD_S / SUBSTEPS
    stopped = dt / INERTIA * COULOMB
    position = velocity = 0.0
    positions = np.empty(len(torque_Nm))
    for i, command in enumerate(torque_Nm):
        positions[i] = position
        for _ in range(SUBSTEPS):
            cogging = COGGING_NM * np.sin(PERIODS * position)
            velocity += dt / INERTIA * (command - VISCOUS * velocity - cogging)
            velocity = 0.0 if abs(velocity) <= stopped else velocity - np.copysign(stopped, velocity)
            position += dt * velocity
    return positions


random = np.random.default_rng(3)
time_s = PERIOD_S * np.arange(15000)
recordings = []
for phase in (0, 2):
    torque_Nm = 0.11 * np.sin(1.3 * time_s + phase) + 0.05 * np.sin(4.1 * time_s) + 0.02 * np.sin(23 * time_s + phase)
    recordings.append(
        youbot.Recording(
            {
                "time_s": time_s,
                "torque_command_Nm": torque_Nm,
                "torque_measured_Nm": torque_Nm + random.normal(0, 0.002, len(torque_Nm)),
                "position_rad": drive(torque_Nm) + random.normal(0, 3e-5, len(torque_Nm)),
            },
            rig="wheel",
        )
    )

known = youbot.DriveModel(
    INERTIA,
    [
        youbot.Effect("coulomb", torque_Nm=COULOMB),
        youbot.Effect("viscous", coefficient_Nm_s_per_rad=VISCOUS),
    ],
    name="wheel",
)
gap = youbot.find_missing_effects(known, recordings)
print(f"{gap.verdict}: {gap.gap_before_Nm:.4f} -> {gap.gap_after_Nm:.4f} N·m, noise floor {gap.noise_floor_Nm:.4f} N·m")
for found in gap.effects:
    print(found.name, *(f"{p.name} {p.value:.4g} ({p.lower:.4g} to {p.upper:.4g})" for p in found.parameters.values()))
print(f"hidden: {COGGING_NM} N·m, {PERIODS} periods a turn")
