"""Where each number of the simulation stands in the flat arrays that the compiled kernel reads."""

from __future__ import annotations

# effects: an amplitude of zero switches its effect off whatever the other numbers are
(
    STRIBECK_EPS, STRIBECK_V, STRIBECK_Q,
    SLIPW_EPS, SLIPW_D, SLIPW_FORM,
    AGE_B, AGE_T0, AGE_D, AGE_POWER, AGE_START,
    RS_B, RS_RATIO, RS_V, RS_D, RS_FORM,
    DIRECT_A, DIRECT_V, DIRECT_FORM,
    CREEP_V, CREEP_ALPHA, CREEP_FORM,
    VISCO_G, VISCO_RENEW,
    KELVIN_ETA, KELVIN_FORM,
    DRAG_C, DRAG_N,
    RESIDUAL_EPS, RESIDUAL_FORM,
    RENEW_RATE, RENEW_FORM,
    MOD_EPS, MOD_F, MOD_PHASE, MOD_FORM,
    TILT_K, TILT_FORM,
    POS_EPS, POS_LENGTH, POS_PHASE, POS_FORM,
    WEAR_EPS, WEAR_LENGTH, WEAR_FORM,
    HEAT_CHI, HEAT_CAPACITY, HEAT_LOSS,
    RIPPLE_A, RIPPLE_PITCH, RIPPLE_PHASE, RIPPLE_FORM,
    COMPLIANCE,
    NLS_EPS, NLS_Y0, NLS_FORM,
    VIB_A, VIB_F, VIB_PHASE, VIB_FORM,
    YAW_EPS, YAW_F, YAW_ZETA,
    RAMP_EPS, RAMP_TAU, RAMP_LENGTH,
    LOOSE_EPS, LOOSE_TIME, LOOSE_FORM,
    EDDY_C, EDDY_LENGTH,
    ANEL_G, ANEL_TAU,
    DETENT_F, DETENT_LENGTH, DETENT_PHASE,
) = range(76)  # fmt: skip
EFFECT_SLOTS: dict[str, int] = {name: slot for name, slot in list(globals().items()) if name.isupper()}
EFFECT_SIZE = len(EFFECT_SLOTS)

# rig
MASS, SPRING, DAMPING, MU_S, MU_K, SLIP_LENGTH, HEAL_TIME = range(7)
RIG_SIZE = 7

# slow states
PSI, AGE, LOG_STATE, TEMPERATURE, PATH, REST = range(6)
STATE_SIZE = 6

# columns of the record
COLUMNS = (
    "displacement",
    "velocity",
    "load_point",
    "spring_force",
    "contact_force",
    "psi",
    "kinetic",
    "stored_spring",
    "stored_contact",
    "contact_work",
    "viscous",
    "drive_work",
    "body_work",
    "yaw",
)
RECORD_SIZE = len(COLUMNS)
EVENT_COLUMNS = ("onset", "arrest", "onset_position", "arrest_position", "peak_velocity", "onset_force", "arrest_force")
