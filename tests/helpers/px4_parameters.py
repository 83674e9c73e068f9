"""Parameters of a PX4 vehicle that suit a careful flight."""

PX4 = {
    "COM_OF_LOSS_T": 1.0,
    "COM_OBL_RC_ACT": 4,
    "RTL_RETURN_ALT": 60.0,
    "COM_RCL_EXCEPT": 4,
    "COM_RC_IN_MODE": 0,
    "MPC_XY_VEL_MAX": 12.0,
    "MPC_Z_VEL_MAX_UP": 3.0,
    "MPC_Z_VEL_MAX_DN": 1.5,
    "MPC_TILTMAX_AIR": 45.0,
    "GF_ACTION": 2,
    "GF_MAX_HOR_DIST": 0.0,
    "GF_MAX_VER_DIST": 0.0,
    "EKF2_EV_CTRL": 11,
    "EKF2_HGT_REF": 3,
}
