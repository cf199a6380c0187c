// SPDX-License-Identifier: Apache-2.0
// The mailbox: what the module knows and plans, in POSIX shared memory, for a program beside it. C11 and C++.
//
// One program writes it, any number read it. Each section has a lock of its own, a sequence: odd while it is being
// written, and another one after each write. Nobody waits for anybody: who reads copies a section out and takes the
// copy when the sequence was even and the same before and after (polygmap_mailbox_try_copy). polygmap_mailbox_reader.h
// opens it, checks it and says in a sentence what is wrong.
//
// Lengths are metres, angles radians, times nanoseconds. Frames are in the names: a_p_b is the place of b in a, a_q_b
// its orientation as a unit quaternion w, x, y, z. odom is smooth and drifts slowly, world is odom corrected by the
// lidar odometry: world_T_odom changes slowly. A sole's frame lies below the ankle, x ahead, z up. Feet and legs are 0
// left, 1 right; joints the left leg's first, each hip roll, hip yaw, hip pitch, knee, ankle pitch, ankle roll.
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "polygmap.h"  // the plan, and the numbers of states and phases

#ifdef __cplusplus
#define POLYGMAP_MAILBOX_FUNCTION constexpr inline
#else
#define POLYGMAP_MAILBOX_FUNCTION static inline
#endif

#define POLYGMAP_MAILBOX_MAGIC UINT64_C(0x58424d50414d4750)  // "PGMAPMBX"
#define POLYGMAP_MAILBOX_VERSION 1U
#define POLYGMAP_MAILBOX_NAME "/polygmap"  // unless configured otherwise

enum {
  POLYGMAP_MAILBOX_FEET = 2,
  POLYGMAP_MAILBOX_JOINTS = 12,
  POLYGMAP_MAILBOX_LANES = 2,
  POLYGMAP_MAILBOX_ROWS = 16,      // of the schedule, at most
  POLYGMAP_MAILBOX_EVENTS = 96,    // faults and limits, at most
  POLYGMAP_MAILBOX_NAMES = 32,     // of an enumeration, at most
  POLYGMAP_MAILBOX_NAME_SIZE = 32  // bytes, a null among them
};

// Whose clock the stamps are of, and in whose time rows are measured.
enum { POLYGMAP_MAILBOX_MONOTONIC = 0, POLYGMAP_MAILBOX_VIRTUAL = 1 };
// header.state
enum { POLYGMAP_MAILBOX_IS_OPEN = 1, POLYGMAP_MAILBOX_IS_CLOSED = 2 };

// Written once, before the magic.
typedef struct polygmap_mailbox_header {
  uint64_t magic;          // last of all: who sees it sees the rest
  uint64_t layout_hash;    // polygmap_mailbox_layout_hash() of the writer
  uint64_t segment_bytes;  // sizeof(polygmap_mailbox) of the writer
  uint32_t version;        // POLYGMAP_MAILBOX_VERSION of the writer
  uint32_t state;          // open, or closed by a writer that ended as it should
  int64_t writer_pid;
  uint64_t writer_start_ticks;  // field 22 of /proc/PID/stat, by which a number that was used again is told
  int64_t opened_ns;            // CLOCK_MONOTONIC
  uint32_t clock;               // of all stamps in the sections; virtual: a simulation's
  uint32_t cycle_us;            // of the module's control, on that clock
} polygmap_mailbox_header;

typedef struct polygmap_mailbox_name {
  char text[POLYGMAP_MAILBOX_NAME_SIZE];
} polygmap_mailbox_name;

// Written once, before the magic: what the numbers in the sections are called. Lists end with an empty name.
typedef struct polygmap_mailbox_names {
  polygmap_mailbox_name module_states[POLYGMAP_MAILBOX_NAMES];
  polygmap_mailbox_name gait_phases[POLYGMAP_MAILBOX_NAMES];
  polygmap_mailbox_name stop_reasons[POLYGMAP_MAILBOX_NAMES];
  polygmap_mailbox_name arming_waits[POLYGMAP_MAILBOX_NAMES];
  polygmap_mailbox_name rows[POLYGMAP_MAILBOX_ROWS];
  polygmap_mailbox_name events[POLYGMAP_MAILBOX_EVENTS];
  uint16_t event_numbers[POLYGMAP_MAILBOX_EVENTS];  // 1 to 99 faults, 101 to 199 limits
  int32_t row_budgets_us[POLYGMAP_MAILBOX_ROWS];    // of a cycle, on the robot
} polygmap_mailbox_names;

// Where the robot is. In every cycle.
typedef struct polygmap_mailbox_pose {
  int64_t stamp_ns;  // of the estimate
  double odom_p_base_m[3];
  double odom_q_base[4];
  double world_p_odom_m[3];
  double world_q_odom[4];
  double odom_v_base_mps[3];
  double base_w_base_radps[3];
  double odom_p_sole_m[POLYGMAP_MAILBOX_FEET][3];
  double odom_q_sole[POLYGMAP_MAILBOX_FEET][4];
  double contact_probability[POLYGMAP_MAILBOX_FEET];
  double q_rad[POLYGMAP_MAILBOX_JOINTS];  // as measured
  double world_p_base_sigma_m[3];
  double odom_v_base_sigma_mps[3];
  double odom_p_base_sigma_m;  // along the axis that is known worst; grows with the way
  double yaw_sigma_rad;
  double tilt_sigma_rad;
  uint32_t initialised;  // 0: it still learns biases and gravity, and the rest is no measurement
  uint32_t reserved;
} polygmap_mailbox_pose;

// A place for a sole.
typedef struct polygmap_mailbox_foothold {
  double odom_p_sole_m[3];
  double odom_yaw_rad;
  double clearance_m;      // signed: from the contact rectangle to the polygon's edges, the least
  double toe_clearance_m;  // signed: to the next riser; +inf when none is mapped
  uint32_t polygon_id;
  uint32_t valid;  // 0: there is none
} polygmap_mailbox_foothold;

// What the module does. In every cycle.
typedef struct polygmap_mailbox_status {
  int64_t stamp_ns;          // the cycle's due time
  uint64_t cycles;           // of control, since the start
  uint32_t module_state;     // as names.module_states and polygmap_state
  uint32_t gait_phase;       // as names.gait_phases and polygmap_phase
  uint32_t stop_reason;      // as names.stop_reasons; 0: none
  uint32_t arming_wait;      // as names.arming_waits: what the module that arms waits for; 0: nothing
  uint32_t treads_climbed;   // by both feet
  uint32_t step_sequence;    // swings from 1; 0: none yet
  uint32_t step_foot;        // of the current or the last swing
  uint32_t step_onto_tread;  // 0: on the floor
  uint32_t joints_silent;    // bit n: the drive of joint n
  uint32_t joints_in_error;
  uint32_t joints_hot;
  uint32_t way_reason;       // as names.stop_reasons: why the search found no way on
  int64_t picture_stamp_ns;  // exposure of the newest picture that is worked off; 0: none yet
  int64_t map_stamp_ns;      // exposure of the newest picture in the map; 0: none yet
  int64_t lio_stamp_ns;      // of the newest lidar pose that was accepted; 0: none yet
  polygmap_mailbox_foothold next[POLYGMAP_MAILBOX_FEET];  // p* for each foot: on the next tread
  double measured_rise_m;                                 // to the next tread; NaN: nothing was seen
  double measured_tread_m;  // from its nosing to what rises behind it; NaN: nothing is mapped there
} polygmap_mailbox_status;

// What a row of the schedule took, of runs that had work. Slack is what a run left of what it was given: its budget and
// what rows before it had left; negative where it took more.
typedef struct polygmap_mailbox_cost {
  uint64_t total_ns;  // of all runs together
  uint64_t most_ns;   // of one run
  int64_t total_slack_ns;
  int64_t least_slack_ns;
} polygmap_mailbox_cost;

// A row of the schedule, since the start.
typedef struct polygmap_mailbox_row {
  uint64_t runs;                // calls that had work
  uint64_t overruns;            // calls longer than they may be
  uint64_t shed;                // slots given up for lack of time
  polygmap_mailbox_cost robot;  // as measured; of a simulation, by the work that was done, at the robot's prices
  polygmap_mailbox_cost host;   // of a simulation, as measured: of this machine, which judges no robot
} polygmap_mailbox_row;

typedef struct polygmap_mailbox_lane {
  uint64_t cycles;
  uint64_t overruns;   // cycles longer than they may be
  uint64_t skipped;    // cycles that were left out
  uint64_t caught_up;  // cycles run late
  uint64_t late_ns;    // from a cycle's due time to its tick, at most
} polygmap_mailbox_lane;

// How long it takes. Every 50 cycles.
typedef struct polygmap_mailbox_timing {
  int64_t stamp_ns;
  uint32_t row_count;
  uint32_t lane_count;
  polygmap_mailbox_row rows[POLYGMAP_MAILBOX_ROWS];
  polygmap_mailbox_lane lanes[POLYGMAP_MAILBOX_LANES];
} polygmap_mailbox_timing;

// How often each fault and limit was raised. Every 50 cycles.
typedef struct polygmap_mailbox_events {
  int64_t stamp_ns;
  uint32_t count[POLYGMAP_MAILBOX_EVENTS];  // as names.events; saturates
} polygmap_mailbox_events;

// Before each section.
typedef struct polygmap_mailbox_lock {
  uint64_t sequence;   // odd while it is written; twice the number of writes
  int64_t written_ns;  // on the module's clock: the cycle's due time
} polygmap_mailbox_lock;

// The plan is polygmap.h's. It is written in every cycle that makes it another one, else every tenth. Its polygons are
// the last of it and most of it: who needs none copies POLYGMAP_MAILBOX_PLAN_BYTES alone.
#define POLYGMAP_MAILBOX_PLAN_BYTES offsetof(polygmap_plan, polygon)

#define POLYGMAP_MAILBOX_ALIGNED __attribute__((aligned(64)))
typedef struct polygmap_mailbox {
  polygmap_mailbox_header header POLYGMAP_MAILBOX_ALIGNED;
  polygmap_mailbox_names names POLYGMAP_MAILBOX_ALIGNED;
  polygmap_mailbox_lock pose_lock POLYGMAP_MAILBOX_ALIGNED;
  polygmap_mailbox_pose pose;
  polygmap_mailbox_lock status_lock POLYGMAP_MAILBOX_ALIGNED;
  polygmap_mailbox_status status;
  polygmap_mailbox_lock plan_lock POLYGMAP_MAILBOX_ALIGNED;
  polygmap_plan plan;
  polygmap_mailbox_lock timing_lock POLYGMAP_MAILBOX_ALIGNED;
  polygmap_mailbox_timing timing;
  polygmap_mailbox_lock events_lock POLYGMAP_MAILBOX_ALIGNED;
  polygmap_mailbox_events events;
} polygmap_mailbox;

// All fields of all structures above. mailbox_layout.hpp refuses a field that is not here.
// clang-format off
#define POLYGMAP_MAILBOX_FIELDS(X) \
  X(polygmap_transform, p_m) X(polygmap_transform, q) \
  X(polygmap_foot_target, foot) X(polygmap_foot_target, certainty) X(polygmap_foot_target, lift_off_ns) \
  X(polygmap_foot_target, touch_down_ns) X(polygmap_foot_target, x_m) X(polygmap_foot_target, y_m) \
  X(polygmap_foot_target, z_m) X(polygmap_foot_target, yaw_rad) X(polygmap_foot_target, up) \
  X(polygmap_foot_target, torso_x_m) X(polygmap_foot_target, torso_y_m) X(polygmap_foot_target, torso_z_m) \
  X(polygmap_foot_target, torso_yaw_rad) X(polygmap_foot_target, polygon_id) X(polygmap_foot_target, onto_tread) \
  X(polygmap_foot_target, returns) \
  X(polygmap_body, time_ns) X(polygmap_body, com_m) X(polygmap_body, com_mps) X(polygmap_body, zmp_m) \
  X(polygmap_body, torso_m) X(polygmap_body, torso_yaw_rad) \
  X(polygmap_contact, begin_ns) X(polygmap_contact, end_ns) X(polygmap_contact, stands) \
  X(polygmap_polygon, id) X(polygmap_polygon, surface) X(polygmap_polygon, sightings) \
  X(polygmap_polygon, vertices) X(polygmap_polygon, last_seen_ns) X(polygmap_polygon, normal) \
  X(polygmap_polygon, offset_sigma_m) X(polygmap_polygon, vertex_m) X(polygmap_polygon, observed) \
  X(polygmap_polygon, has_nosing) X(polygmap_polygon, nosing_m) \
  X(polygmap_stairs, state) X(polygmap_stairs, climbed) X(polygmap_stairs, rise_m) X(polygmap_stairs, tread_m) \
  X(polygmap_stairs, heading_rad) X(polygmap_stairs, nosing_m) \
  X(polygmap_foot, odom_T_sole) X(polygmap_foot, stands) \
  X(polygmap_plan, size) X(polygmap_plan, phase) X(polygmap_plan, stamp_ns) X(polygmap_plan, map_stamp_ns) \
  X(polygmap_plan, held) X(polygmap_plan, stairs) X(polygmap_plan, foot) X(polygmap_plan, step_count) \
  X(polygmap_plan, contact_count) X(polygmap_plan, body_count) X(polygmap_plan, polygon_count) \
  X(polygmap_plan, step) X(polygmap_plan, contact) X(polygmap_plan, body) X(polygmap_plan, polygon) \
  X(polygmap_mailbox_header, magic) X(polygmap_mailbox_header, layout_hash) \
  X(polygmap_mailbox_header, segment_bytes) X(polygmap_mailbox_header, version) X(polygmap_mailbox_header, state) \
  X(polygmap_mailbox_header, writer_pid) X(polygmap_mailbox_header, writer_start_ticks) \
  X(polygmap_mailbox_header, opened_ns) X(polygmap_mailbox_header, clock) X(polygmap_mailbox_header, cycle_us) \
  X(polygmap_mailbox_name, text) \
  X(polygmap_mailbox_names, module_states) X(polygmap_mailbox_names, gait_phases) \
  X(polygmap_mailbox_names, stop_reasons) X(polygmap_mailbox_names, arming_waits) X(polygmap_mailbox_names, rows) \
  X(polygmap_mailbox_names, events) X(polygmap_mailbox_names, event_numbers) \
  X(polygmap_mailbox_names, row_budgets_us) \
  X(polygmap_mailbox_pose, stamp_ns) X(polygmap_mailbox_pose, odom_p_base_m) X(polygmap_mailbox_pose, odom_q_base) \
  X(polygmap_mailbox_pose, world_p_odom_m) X(polygmap_mailbox_pose, world_q_odom) \
  X(polygmap_mailbox_pose, odom_v_base_mps) X(polygmap_mailbox_pose, base_w_base_radps) \
  X(polygmap_mailbox_pose, odom_p_sole_m) X(polygmap_mailbox_pose, odom_q_sole) \
  X(polygmap_mailbox_pose, contact_probability) X(polygmap_mailbox_pose, q_rad) \
  X(polygmap_mailbox_pose, world_p_base_sigma_m) X(polygmap_mailbox_pose, odom_v_base_sigma_mps) \
  X(polygmap_mailbox_pose, odom_p_base_sigma_m) X(polygmap_mailbox_pose, yaw_sigma_rad) \
  X(polygmap_mailbox_pose, tilt_sigma_rad) X(polygmap_mailbox_pose, initialised) \
  X(polygmap_mailbox_pose, reserved) \
  X(polygmap_mailbox_foothold, odom_p_sole_m) X(polygmap_mailbox_foothold, odom_yaw_rad) \
  X(polygmap_mailbox_foothold, clearance_m) X(polygmap_mailbox_foothold, toe_clearance_m) \
  X(polygmap_mailbox_foothold, polygon_id) X(polygmap_mailbox_foothold, valid) \
  X(polygmap_mailbox_status, stamp_ns) X(polygmap_mailbox_status, cycles) X(polygmap_mailbox_status, module_state) \
  X(polygmap_mailbox_status, gait_phase) X(polygmap_mailbox_status, stop_reason) \
  X(polygmap_mailbox_status, arming_wait) X(polygmap_mailbox_status, treads_climbed) \
  X(polygmap_mailbox_status, step_sequence) X(polygmap_mailbox_status, step_foot) \
  X(polygmap_mailbox_status, step_onto_tread) X(polygmap_mailbox_status, joints_silent) \
  X(polygmap_mailbox_status, joints_in_error) X(polygmap_mailbox_status, joints_hot) \
  X(polygmap_mailbox_status, way_reason) X(polygmap_mailbox_status, picture_stamp_ns) \
  X(polygmap_mailbox_status, map_stamp_ns) X(polygmap_mailbox_status, lio_stamp_ns) \
  X(polygmap_mailbox_status, next) X(polygmap_mailbox_status, measured_rise_m) \
  X(polygmap_mailbox_status, measured_tread_m) \
  X(polygmap_mailbox_cost, total_ns) X(polygmap_mailbox_cost, most_ns) X(polygmap_mailbox_cost, total_slack_ns) \
  X(polygmap_mailbox_cost, least_slack_ns) \
  X(polygmap_mailbox_row, runs) X(polygmap_mailbox_row, overruns) X(polygmap_mailbox_row, shed) \
  X(polygmap_mailbox_row, robot) X(polygmap_mailbox_row, host) \
  X(polygmap_mailbox_lane, cycles) X(polygmap_mailbox_lane, overruns) X(polygmap_mailbox_lane, skipped) \
  X(polygmap_mailbox_lane, caught_up) X(polygmap_mailbox_lane, late_ns) \
  X(polygmap_mailbox_timing, stamp_ns) X(polygmap_mailbox_timing, row_count) \
  X(polygmap_mailbox_timing, lane_count) X(polygmap_mailbox_timing, rows) X(polygmap_mailbox_timing, lanes) \
  X(polygmap_mailbox_events, stamp_ns) X(polygmap_mailbox_events, count) \
  X(polygmap_mailbox_lock, sequence) X(polygmap_mailbox_lock, written_ns) \
  X(polygmap_mailbox, header) X(polygmap_mailbox, names) X(polygmap_mailbox, pose_lock) X(polygmap_mailbox, pose) \
  X(polygmap_mailbox, status_lock) X(polygmap_mailbox, status) X(polygmap_mailbox, plan_lock) \
  X(polygmap_mailbox, plan) X(polygmap_mailbox, timing_lock) X(polygmap_mailbox, timing) \
  X(polygmap_mailbox, events_lock) X(polygmap_mailbox, events)
// clang-format on

// FNV-1a over the name, place and size of every field: two programs that agree on it agree on every byte.
POLYGMAP_MAILBOX_FUNCTION uint64_t polygmap_mailbox_hash(uint64_t hash, const char* name, size_t offset, size_t size) {
  const uint64_t prime = UINT64_C(1099511628211);
  for (; *name != '\0'; ++name) hash = (hash ^ (uint64_t)(unsigned char)*name) * prime;
  hash = (hash ^ (uint64_t)offset) * prime;
  return (hash ^ (uint64_t)size) * prime;
}
POLYGMAP_MAILBOX_FUNCTION uint64_t polygmap_mailbox_layout_hash(void) {
  uint64_t hash = UINT64_C(14695981039346656037);
#define POLYGMAP_MAILBOX_ADD(type, field) \
  hash = polygmap_mailbox_hash(hash, #type "." #field, offsetof(type, field), sizeof(((type*)0)->field));
  POLYGMAP_MAILBOX_FIELDS(POLYGMAP_MAILBOX_ADD)
#undef POLYGMAP_MAILBOX_ADD
  return hash;
}

// A section is copied while the other side may be at it: the sequence says whether the copy counts. ThreadSanitizer
// knows no fences, and is content with atomic words.
static inline void polygmap_mailbox_copy_in(void* shared, const void* own, size_t bytes) {
#ifdef __SANITIZE_THREAD__
  for (size_t i = 0; i < bytes / 8; ++i) {
    __atomic_store_n((uint64_t*)shared + i, ((const uint64_t*)own)[i], __ATOMIC_RELEASE);
  }
#else
  __atomic_thread_fence(__ATOMIC_RELEASE);
  memcpy(shared, own, bytes);
#endif
}
static inline void polygmap_mailbox_copy_out(void* own, const void* shared, size_t bytes) {
#ifdef __SANITIZE_THREAD__
  for (size_t i = 0; i < bytes / 8; ++i) {
    ((uint64_t*)own)[i] = __atomic_load_n((const uint64_t*)shared + i, __ATOMIC_ACQUIRE);
  }
#else
  memcpy(own, shared, bytes);
  __atomic_thread_fence(__ATOMIC_ACQUIRE);
#endif
}

// Copies a section out, whole: false when it was never written, or when it was being written in each of some tries. The
// caller then keeps what it has and tries again in its next cycle.
static inline bool polygmap_mailbox_try_copy(const polygmap_mailbox_lock* lock, const void* section, void* copy,
                                             size_t bytes) {
  enum { kTries = 16 };
  for (int i = 0; i < kTries; ++i) {
    const uint64_t before = __atomic_load_n(&lock->sequence, __ATOMIC_ACQUIRE);
    if (before == 0) return false;
    if (before % 2 != 0) continue;
    polygmap_mailbox_copy_out(copy, section, bytes);
    if (__atomic_load_n(&lock->sequence, __ATOMIC_RELAXED) == before) return true;
  }
  return false;
}
