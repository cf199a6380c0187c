ROBOT ready
ROBOT commands=11880 enters=12 exits=0 gains=1 poses=19
TOLD STATUS=arming, no answer yet from left_hip_roll, left_hip_yaw, left_hip_pitch, left_knee, left_ankle_pitch, left_ankle_roll, right_hip_roll, right_hip_yaw, right_hip_pitch, right_knee, right_ankle_pitch, right_ankle_roll; cycles 0, overruns 0, skipped 0, heap calls 0
TOLD READY=1
TOLD WATCHDOG=1
TOLD STATUS=walking_up, standing, 0 treads; cycles 6, overruns 0, skipped 0, heap calls 0
TOLD WATCHDOG=1
TOLD WATCHDOG=1
TOLD WATCHDOG=1
TOLD WATCHDOG=1
TOLD WATCHDOG=1
TOLD WATCHDOG=1
TOLD WATCHDOG=1
TOLD WATCHDOG=1
TOLD WATCHDOG=1
TOLD WATCHDOG=1
TOLD STATUS=walking_up, standing, 0 treads; cycles 510, overruns 0, skipped 0, heap calls 0; faults imu_missing 1
TOLD WATCHDOG=1
TOLD WATCHDOG=1
TOLD WATCHDOG=1
TOLD WATCHDOG=1
TOLD WATCHDOG=1
TOLD WATCHDOG=1
TOLD WATCHDOG=1
TOLD WATCHDOG=1
TOLD WATCHDOG=1
TOLD STOPPING=1
