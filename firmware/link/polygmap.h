// SPDX-License-Identifier: Apache-2.0
// PolygMap-RT for C: perceptive stair climbing for humanoid robots, as a module that a controller calls every 2 ms.
//
// What a sensor says is pushed, a step runs the module, and what it decided is read: above all one command for every
// joint. An instance lives in memory of the caller's. Nothing is allocated, in polygmap_create() neither; there are no
// callbacks, no threads and no global state, so that a process may have as many instances as it has memory for. What an
// instance does follows from what was pushed, stepped and configured alone: the same inputs give the same commands, to
// the bit, on x86 and on AArch64.
//
// Threads: calls on one instance must not overlap. Different instances know nothing of each other. A call takes less
// than 32 kB of stack.
//
// Results: every int that a function returns is POLYGMAP_OK or one of the negative polygmap_error. A call that fails
// has changed nothing, unless it says so here.
//
// Structs: each begins with its own size, which the caller sets (polygmap_imu imu = {sizeof imu};). A struct of another
// version of this header has another size and is refused as POLYGMAP_E_SIZE.
//
// Time: stamps are ns of one monotonic clock, any that counts up; where it has its zero does not matter. All stamps,
// and the now_ns of polygmap_step(), are of that clock.
//
// Units stand in the names: _m, _rad, _s, _ns, _px, _n (newton), _nm (newton metre), _kg; _mps and _radps per second,
// _mps2 per second squared, _nmprad newton metre per radian.
//
// Frames: x ahead, y left, z up. base: the pelvis. sole: below the ankle on the ground plane of the foot, x towards the
// toe. odom: the module's own, moves smoothly and drifts slowly; everything the module plans is in it. world: odom,
// corrected by the lidar odometry. odom_T_base is the pose of the base in odom: its place, and its axes as a
// quaternion (w, x, y, z). Rotations of nine numbers (lio_R_lidar) are stored row by row.
//
// Joints: 0 to 5 the left leg's hip roll, hip yaw, hip pitch, knee, ankle pitch and ankle roll, 6 to 11 the right
// leg's. Feet: 0 left, 1 right.
//
// In C++ programs the type polygmap is global; a program that includes the module's own C++ headers, whose namespace
// has that name, includes those in other files than this one.
#pragma once

#include <stddef.h>
#include <stdint.h>

// NOLINTBEGIN(readability-identifier-naming,modernize-avoid-c-arrays): this is C
#ifdef __cplusplus
extern "C" {
#endif

#define POLYGMAP_VERSION_MAJOR 0
#define POLYGMAP_VERSION_MINOR 2
#define POLYGMAP_VERSION_PATCH 0
#define POLYGMAP_VERSION_TEXT "0.2.0"
// For comparisons: POLYGMAP_VERSION_NUMBER >= 10200 is 1.2.0 or newer.
#define POLYGMAP_VERSION_NUMBER (POLYGMAP_VERSION_MAJOR * 10000 + POLYGMAP_VERSION_MINOR * 100 + POLYGMAP_VERSION_PATCH)

#define POLYGMAP_JOINTS 12
#define POLYGMAP_FEET 2
#define POLYGMAP_ALIGNMENT 64
// No less than polygmap_memory_size() of this version, for memory that is to be there before the program runs.
#define POLYGMAP_MEMORY_BYTES (4u * 1024u * 1024u)

// One cycle of the module.
#define POLYGMAP_CYCLE_NS 2000000

typedef struct polygmap polygmap;

typedef enum polygmap_error {
  POLYGMAP_OK = 0,
  POLYGMAP_E_NULL = -1,       // a pointer that must point to something is NULL
  POLYGMAP_E_SIZE = -2,       // a struct's size is not that of this version
  POLYGMAP_E_ALIGNMENT = -3,  // the memory is not aligned to POLYGMAP_ALIGNMENT
  POLYGMAP_E_MEMORY = -4,     // the memory is smaller than polygmap_memory_size()
  POLYGMAP_E_CONFIG = -5,     // the configuration cannot be used: polygmap_create_error() says where and why
  POLYGMAP_E_INSTANCE = -6,   // there is no instance at that place: none was made there, or it was destroyed
  POLYGMAP_E_STAMP = -7,      // out of order: not after the one before, or far from the instance's time
  POLYGMAP_E_PICTURE = -8,    // a picture has another size than the configured camera's
  POLYGMAP_E_OPERATE = -9,    // there is no such polygmap_operation
  POLYGMAP_E_FULL = -10,      // too many operations wait for a step
  POLYGMAP_E_NONE = -11,      // there is nothing of that kind, or not yet
  POLYGMAP_E_PLACE = -12,     // no place to go to: not a number, farther than 50 m, or turned by more than 3.2 rad
} polygmap_error;

// One sentence of any number that a function here returned. Never NULL; the text is static.
const char* polygmap_error_text(int error);
// Of the library that is linked: POLYGMAP_VERSION_TEXT of the header it was built with.
const char* polygmap_version(void);

// ---------------------------------------------------------------------------------------------------------------------
// The instance

// Bytes that an instance takes.
size_t polygmap_memory_size(void);

// Makes an instance in the caller's memory, which is aligned to POLYGMAP_ALIGNMENT, has at least polygmap_memory_size()
// bytes and belongs to the instance until polygmap_destroy(). The instance may not be moved or copied.
// config: NULL for a KUAVO with its camera, or the text of a parameter file, terminated by a null: what
//   `polygmap params list` prints and docs/reference/params.md explains; what it names is changed, all else stays.
//   A table [camera] has the camera: the keys of a camera file. The text is not needed after the call.
// On failure *out becomes NULL.
int polygmap_create(polygmap** out, void* memory, size_t bytes, const char* config);
// What was wrong with the configuration, with line and key, after polygmap_create() returned POLYGMAP_E_CONFIG on that
// memory: a sentence that lies in it, and stays until the memory is used otherwise. Empty text where nothing failed so.
// memory: as given to polygmap_create(), not NULL.
const char* polygmap_create_error(const void* memory);
// The memory is the caller's again; there is nothing else to release. NULL is allowed.
void polygmap_destroy(polygmap* instance);

// ---------------------------------------------------------------------------------------------------------------------
// What goes in. A sample is copied; a step reads what was pushed before it. Stamps of one kind increase strictly, and
// lie no more than a second after the last step's now_ns: others are POLYGMAP_E_STAMP and left out. What is not finite
// or out of range is taken, left out by the module and counted (polygmap_read_faults), as from any sensor. Where more
// is pushed than steps read, the oldest is pushed out, and polygmap_status counts it.

// Base frame, at its origin.
typedef struct polygmap_imu {
  uint32_t size;
  int64_t stamp_ns;
  double gyro_radps[3];
  double accel_mps2[3];  // specific force: +9.81 upwards at rest
} polygmap_imu;
// Up to 64 samples wait; a step reads four.
int polygmap_push_imu(polygmap* instance, const polygmap_imu* sample);

#define POLYGMAP_NEVER_HEARD 65535
#define POLYGMAP_NOT_TOLD_DEGC (-32768)

// Feedback of all drives. Only the newest one counts.
typedef struct polygmap_joints {
  uint32_t size;
  uint32_t drive_errors;  // bit n: the drive of joint n tells of an error
  int64_t stamp_ns;       // of the newest replies
  double q_rad[POLYGMAP_JOINTS];
  double dq_radps[POLYGMAP_JOINTS];
  double tau_nm[POLYGMAP_JOINTS];      // not a number where a drive tells none
  double foot_force_n[POLYGMAP_FEET];  // vertical, 0 in the air; not a number where no sensor tells it
  // How many cycles of 2 ms before stamp_ns the joint's own reply lies, 0: none. A silent drive's joint keeps its last
  // values and counts up; POLYGMAP_NEVER_HEARD: it has none yet.
  uint16_t silent_cycles[POLYGMAP_JOINTS];
  int16_t drive_degc[POLYGMAP_JOINTS];  // whole degrees, or POLYGMAP_NOT_TOLD_DEGC
  // Bit n: the drive of joint n did not take the command that was read last. The module counts its next one as refused.
  uint32_t refused_joints;
} polygmap_joints;
int polygmap_push_joints(polygmap* instance, const polygmap_joints* feedback);

// A pose of the lidar in a level world of its odometry's own, when it arrives: it may be late.
typedef struct polygmap_lio {
  uint32_t size;
  int64_t stamp_ns;       // of the scan, not of the arrival
  double lio_R_lidar[9];  // polygmap_rotation_of() makes it of a quaternion
  double lio_p_lidar_m[3];
  double position_sigma_m[3];    // 0: not stated
  double rotation_sigma_rad[3];  // 0: not stated
} polygmap_lio;
// Up to 16 poses wait; a step reads four.
int polygmap_push_lio(polygmap* instance, const polygmap_lio* pose);
// The rotation of a quaternion (w, x, y, z) of any length, row by row. POLYGMAP_E_NONE, and nothing is written, where
// it has no finite length above 0.
int polygmap_rotation_of(const double wxyz[4], double rotation[9]);

// A depth picture of the configured camera.
typedef struct polygmap_depth {
  uint32_t size;
  uint32_t sequence;  // counts the camera's pictures; for the caller's own use
  int64_t stamp_ns;   // middle of the exposure
  int32_t width_px;
  int32_t height_px;
  // Row by row from the top left, width_px x height_px, in units of the camera's depth_unit_m along the optical axis;
  // 0: no depth. They are copied before the call returns, and never looked at again.
  const uint16_t* pixels;
} polygmap_depth;
// One picture waits while the module works on another for some cycles; a newer one takes its place.
int polygmap_push_depth(polygmap* instance, const polygmap_depth* picture);

// ---------------------------------------------------------------------------------------------------------------------
// The step

// Runs the module: all of its schedule, on this thread. The first step begins the schedule: cycles are due at its
// now_ns and every 2 ms from there. A step runs the cycles that are due by now_ns. One that comes before the next is
// due runs nothing and is no error (polygmap_status.next_due_ns says when that is). A late one runs up to two cycles
// that were missed, then its own; older ones are skipped and counted, and where that happens too often the module
// brings the robot to a stop on two feet (the fault time_short). now_ns: later than that of the last step, else
// POLYGMAP_E_STAMP. The module has no other clock: within a step time stands still for it, work is paid in units that
// are the same on every machine, and it never takes itself for too slow. Whether a step fits its 2 ms is for the caller
// to see to.
int polygmap_step(polygmap* instance, int64_t now_ns);

// ---------------------------------------------------------------------------------------------------------------------
// The operator

typedef enum polygmap_operation {
  POLYGMAP_OPERATE_ARM = 1,        // take the robot over, and stand
  POLYGMAP_OPERATE_START = 2,      // walk up and climb
  POLYGMAP_OPERATE_PAUSE = 3,      // the foot in the air comes down, then stand
  POLYGMAP_OPERATE_RESUME = 4,     // go on
  POLYGMAP_OPERATE_STOP = 5,       // the foot in the air comes down, then end
  POLYGMAP_OPERATE_RESET = 6,      // after an end whose cause is over: stand, and be ready to start
  POLYGMAP_OPERATE_HAND_OVER = 7,  // let go of a robot that stands, for another controller
  POLYGMAP_OPERATE_GO_TO = 8,      // what polygmap_go_to() asks; polygmap_operate() does not take it
} polygmap_operation;

// Asks for it; the next cycle that has not been asked for something else answers, and polygmap_status has the answer.
// It is refused there where the module's state has no answer to it (docs/reference/states.md). Unless the configuration
// has supervisor.autostart = false the module arms and starts by itself.
int polygmap_operate(polygmap* instance, int command);

// The same, and answered likewise: to walk and climb to a place and end there, from where it stands when its next step
// hears of it: ahead and to the left of the middle between the feet, m, 50 at most. turn_rad: how the heading there is
// turned to the left against the present one, from -3.2 to 3.2; not a number: any heading will do. up_m: how much
// higher the ground there lies than that under the lower foot, to 0.09 m, 50 at most, negative down; not a number: any
// storey will do.
int polygmap_go_to(polygmap* instance, double ahead_m, double left_m, double turn_rad, double up_m);

// ---------------------------------------------------------------------------------------------------------------------
// What comes out, as of the last step. A read changes nothing, and may be repeated.

// One command for every drive: torque = tau_ff + kp (q - measured q) + kd (dq - measured dq).
typedef struct polygmap_command {
  uint32_t size;
  int64_t stamp_ns;  // of the cycle that made it
  double q_rad[POLYGMAP_JOINTS];
  double dq_radps[POLYGMAP_JOINTS];
  double tau_ff_nm[POLYGMAP_JOINTS];
  double kp_nmprad[POLYGMAP_JOINTS];
  double kd_nmsprad[POLYGMAP_JOINTS];
} polygmap_command;
// POLYGMAP_E_NONE, and nothing is written, where the last cycle made none: the drives are to be sent nothing then. That
// is so before it asks the drives for their first reply, and once the robot was handed over.
int polygmap_read_command(const polygmap* instance, polygmap_command* command);

typedef struct polygmap_transform {
  double p_m[3];
  double q[4];  // w, x, y, z
} polygmap_transform;

// The estimate of the robot's motion.
typedef struct polygmap_pose {
  uint32_t size;
  uint32_t initialised;     // 0: it still calibrates itself, standing
  int64_t stamp_ns;         // of the state
  int64_t oldest_input_ns;  // of its newest IMU and its newest joint sample, the older one's stamp
  int64_t lio_age_ns;       // since the last lidar pose that was used; -1: none yet
  polygmap_transform odom_T_base;
  double odom_v_base_mps[3];
  double base_w_base_radps[3];
  polygmap_transform world_T_base;
  polygmap_transform world_T_odom;
  polygmap_transform odom_T_sole[POLYGMAP_FEET];
  double contact_probability[POLYGMAP_FEET];
  double position_sigma_m[3];  // of the place in world_T_base
  double velocity_sigma_mps[3];
  double odom_sigma_m;   // of the place in odom_T_base along the axis that is known worst; grows with the way
  double yaw_sigma_rad;  // of the heading in world_T_base
  double tilt_sigma_rad;
  // Of the place in world (m), the velocity in odom (m/s) and the rotation that takes the estimated attitude to the
  // true one (rad, odom axes), in this order: of what is true minus what is estimated.
  double covariance[9][9];
} polygmap_pose;
// POLYGMAP_E_NONE before the first estimate.
int polygmap_read_pose(const polygmap* instance, polygmap_pose* pose);

typedef enum polygmap_state {
  POLYGMAP_STATE_OFF,
  POLYGMAP_STATE_ARMING,
  POLYGMAP_STATE_STANDING,
  POLYGMAP_STATE_WALKING_UP,
  POLYGMAP_STATE_CLIMBING,
  POLYGMAP_STATE_HOLDING,
  POLYGMAP_STATE_STOPPING,
  POLYGMAP_STATE_SAFE_STOP,
  POLYGMAP_STATE_ON_TOP,
  POLYGMAP_STATE_FALLEN,
  POLYGMAP_STATE_HANDING_OVER,
  POLYGMAP_STATE_RELEASED,
} polygmap_state;
typedef enum polygmap_phase {
  POLYGMAP_PHASE_STANDING,
  POLYGMAP_PHASE_DOUBLE_SUPPORT,  // the weight moves over the foot that is to stand alone
  POLYGMAP_PHASE_SWING,           // one foot in the air
  POLYGMAP_PHASE_FINISHED,        // the climb is over, on top
  POLYGMAP_PHASE_STOPPED,         // on both feet; stop_reason says why
} polygmap_phase;
// As docs/reference/states.md has it, "unknown" for a number that is none. The texts are static.
const char* polygmap_state_name(int state);
// Of polygmap_status: a name for machines, and what may follow "the module stopped: ".
const char* polygmap_stop_reason_name(int stop_reason);
const char* polygmap_stop_reason_text(int stop_reason);
// What arming waits for, and why an operation was refused: words, beside the joints or degrees of polygmap_status.
const char* polygmap_arming_text(int arming_wait);
const char* polygmap_refusal_text(int refusal);
// "left_knee"
const char* polygmap_joint_name(int joint);

// Since the first step.
typedef struct polygmap_cycles {
  int64_t next_due_ns;  // when the next one is due; 0 before the first step
  uint64_t run;
  uint64_t skipped;  // that a step came too late for
  uint64_t late;     // run after the next one was due
} polygmap_cycles;
// What a module that arms waits for.
typedef struct polygmap_arming {
  int32_t wait;       // for polygmap_arming_text(); 0: nothing
  uint32_t joints;    // bit n: joint n is meant
  uint32_t lean_deg;  // of a wait whose text speaks of degrees
} polygmap_arming;
// Bit n is the drive of joint n.
typedef struct polygmap_drives {
  uint32_t silent;  // for more than 10 ms
  uint32_t errors;  // it tells of an error
  uint32_t hot;     // too hot, until it has cooled
} polygmap_drives;
// To polygmap_operate().
typedef struct polygmap_answer {
  uint32_t answered;  // operations so far; of the last of them:
  int32_t operation;  // polygmap_operation; 0: none yet
  int32_t refusal;    // for polygmap_refusal_text(); 0: it was obeyed
  uint32_t joints;    // bit n: the refusal is about joint n
} polygmap_answer;
// Pushed out before a step read them.
typedef struct polygmap_dropped {
  uint32_t imu;
  uint32_t lio;
  uint32_t depth;
} polygmap_dropped;

typedef struct polygmap_status {
  uint32_t size;
  int32_t state;            // polygmap_state
  int64_t stamp_ns;         // of the last cycle; 0 before the first
  int32_t phase;            // polygmap_phase
  int32_t stop_reason;      // 0: none
  double stop_measured_m;   // the rise or tread behind stop_reason, of too_steep what it rises over a metre; 0: none
  uint32_t treads_climbed;  // both feet on it, by the module's own count
  polygmap_arming arming;
  polygmap_drives drives;
  polygmap_answer answer;
  polygmap_dropped dropped;
  polygmap_cycles cycles;
} polygmap_status;
int polygmap_read_status(const polygmap* instance, polygmap_status* status);

#define POLYGMAP_MAX_FAULTS 64
typedef struct polygmap_fault {
  int32_t number;  // of docs/reference/faults.md: 1 to 99 a fault, 101 to 199 a limit
  uint32_t count;  // saturates
  int64_t first_ns;
  int64_t last_ns;
} polygmap_fault;
typedef struct polygmap_faults {
  uint32_t size;
  uint32_t count;  // of what follows: what was raised so far, by number
  polygmap_fault fault[POLYGMAP_MAX_FAULTS];
} polygmap_faults;
int polygmap_read_faults(const polygmap* instance, polygmap_faults* faults);
// "imu_missing", and a sentence. "unknown" for a number that is none.
const char* polygmap_fault_name(int number);
const char* polygmap_fault_text(int number);

// ---------------------------------------------------------------------------------------------------------------------
// The plan: what the module means to do, in odom, for a controller that has whole-body control of its own, or to show.
// It is of the gait's own objects at the last step. What is not known is not a number, or has a flag.

#define POLYGMAP_MAX_STEPS 2
#define POLYGMAP_MAX_CONTACTS 5
#define POLYGMAP_BODY_SAMPLES 32
#define POLYGMAP_MAX_POLYGONS 64
#define POLYGMAP_MAX_VERTICES 24

typedef enum polygmap_certainty {
  POLYGMAP_STEP_LATCHED,   // its foot is in the air: the target is frozen
  POLYGMAP_STEP_PLANNED,   // the weight is on its way for it; its target may still move, and its foot may lift later
  POLYGMAP_STEP_EXPECTED,  // the one that may come after; nothing of it is proved, its times are the usual durations
} polygmap_certainty;

// A foot pose target, as KUAVO controllers have it: when, which foot, where the sole comes to stand, and the torso
// then.
typedef struct polygmap_foot_target {
  int32_t foot;
  int32_t certainty;      // polygmap_certainty
  int64_t lift_off_ns;    // 0: no time is planned
  int64_t touch_down_ns;  // the target's time; 0: none is planned, since the plan stands still or the foot goes back
  double x_m;             // of the sole frame's origin
  double y_m;
  double z_m;
  double yaw_rad;
  double up[3];      // normal of what the sole is to lie on
  double torso_x_m;  // of the base at touch_down_ns; not a number for a step that is only expected, or without a time
  double torso_y_m;
  double torso_z_m;
  double torso_yaw_rad;
  uint32_t polygon_id;  // of the map, that it lies on; 0: none is known, as on the floor
  uint32_t onto_tread;  // 0: on the floor while walking up
  uint32_t returns;     // 1: the foot goes back to where it stood, and that is the target
} polygmap_foot_target;

// The body at one moment of the plan.
typedef struct polygmap_body {
  int64_t time_ns;
  double com_m[3];
  double com_mps[3];
  double zmp_m[2];    // zero-moment point
  double torso_m[3];  // of the base, over that centre of mass with the legs as they are now
  double torso_yaw_rad;
} polygmap_body;

// Which feet are to stand from begin_ns to end_ns.
typedef struct polygmap_contact {
  int64_t begin_ns;
  int64_t end_ns;  // INT64_MAX: no end is planned
  uint32_t stands[POLYGMAP_FEET];
} polygmap_contact;

typedef enum polygmap_surface {
  POLYGMAP_SURFACE_TREAD,  // level
  POLYGMAP_SURFACE_RISER,  // upright
  POLYGMAP_SURFACE_OTHER,
} polygmap_surface;

// A surface of the map: convex, counter-clockwise seen from outside.
typedef struct polygmap_polygon {
  uint32_t id;            // never used again
  int32_t surface;        // polygmap_surface
  uint32_t sightings;     // pictures it was fused from
  uint32_t vertices;      // how many there are
  int64_t last_seen_ns;   // exposure of the last picture that saw it
  double normal[3];       // out of the surface
  double offset_sigma_m;  // of its place along the normal, against the robot
  double vertex_m[POLYGMAP_MAX_VERTICES][3];
  uint32_t observed[POLYGMAP_MAX_VERTICES];  // edge i, from vertex i to the next: 1 the surface ends there, 0 the view
  uint32_t has_nosing;                       // 1: the front edge of a tread is known,
  double nosing_m[2][3];                     // from left to right
} polygmap_polygon;

typedef enum polygmap_stair_state {
  POLYGMAP_STAIRS_NONE,         // no staircase is known
  POLYGMAP_STAIRS_APPROACHING,  // one is mapped ahead, and the robot is still on the floor
  POLYGMAP_STAIRS_CLIMBING,     // it has begun to step onto treads
  POLYGMAP_STAIRS_ON_TOP,       // the climb is over
} polygmap_stair_state;

// As the newest search for footholds found them.
typedef struct polygmap_stairs {
  int32_t state;          // polygmap_stair_state
  uint32_t climbed;       // treads, both feet on them
  double rise_m;          // from the foot that stands to the next tread; not a number: none is seen
  double tread_m;         // depth of the next tread; not a number: what ends it is not seen
  double heading_rad;     // the way up, across the next nosing; not a number: there is no foothold ahead
  double nosing_m[2][3];  // front edge of the next tread, from left to right; not a number likewise
} polygmap_stairs;

// A foot as planned now.
typedef struct polygmap_foot {
  polygmap_transform odom_T_sole;  // where it is to be; not a number while there is no plan yet
  uint32_t stands;                 // 0: it is to be in the air
} polygmap_foot;

typedef struct polygmap_plan {
  uint32_t size;
  int32_t phase;         // polygmap_phase
  int64_t stamp_ns;      // of the cycle that it is as of
  int64_t map_stamp_ns;  // exposure of the newest picture in the map; 0: none yet
  uint32_t held;         // 1: a drive is silent, the body stays where it is, and nothing has a planned time
  polygmap_stairs stairs;
  polygmap_foot foot[POLYGMAP_FEET];
  // How many of each there are. 0 steps: none is decided. 0 bodies and contacts: there is no plan yet.
  uint32_t step_count;
  uint32_t contact_count;
  uint32_t body_count;
  uint32_t polygon_count;
  polygmap_foot_target step[POLYGMAP_MAX_STEPS];  // in their order
  polygmap_contact contact[POLYGMAP_MAX_CONTACTS];
  polygmap_body body[POLYGMAP_BODY_SAMPLES];  // every 50 ms from stamp_ns on; beyond its end the plan rests
  polygmap_polygon polygon[POLYGMAP_MAX_POLYGONS];
} polygmap_plan;
// About 60 kB: not for a small stack. Takes some tens of microseconds. POLYGMAP_E_NONE before the first cycle.
int polygmap_read_plan(const polygmap* instance, polygmap_plan* plan);

#ifdef __cplusplus
}
#endif
// NOLINTEND(readability-identifier-naming,modernize-avoid-c-arrays)
