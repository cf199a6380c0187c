// SPDX-License-Identifier: Apache-2.0
// The functions of polygmap.h.
#include <bit>
#include <cmath>
#include <cstring>
#include <new>

#include "firmware/link/instance.hpp"
#include "firmware/link/readings.hpp"

namespace {

using polygmap::link::Instance;
using polygmap::link::Mark;

static_assert(POLYGMAP_JOINTS == polygmap::kJointCount && POLYGMAP_FEET == polygmap::kFootCount);
static_assert(POLYGMAP_CYCLE_NS == polygmap::kCycle_ns);
static_assert(POLYGMAP_NEVER_HEARD == polygmap::JointFeedback::kNeverHeard);
static_assert(POLYGMAP_NOT_TOLD_DEGC == polygmap::kNotTold_degc);

// What a call begins with: null where it is no instance.
Instance* alive(polygmap_handle* handle) noexcept {
  auto* instance = reinterpret_cast<Instance*>(handle);
  return instance->mark == Mark::kAlive ? instance : nullptr;
}
const Instance* alive(const polygmap_handle* handle) noexcept {
  const auto* instance = reinterpret_cast<const Instance*>(handle);
  return instance->mark == Mark::kAlive ? instance : nullptr;
}

// Into the instance: what is done with a struct of the right size.
template <class Struct, class Function>
int push(polygmap_handle* handle, const Struct* from, Function function) noexcept {
  if (handle == nullptr || from == nullptr) return POLYGMAP_E_NULL;
  Instance* instance = alive(handle);
  if (instance == nullptr) return POLYGMAP_E_INSTANCE;
  if (from->size != sizeof(Struct)) return POLYGMAP_E_SIZE;
  return function(*instance, *from);
}
// Out of it: where there is nothing, nothing is written.
template <class Struct, class Function>
int read(const polygmap_handle* handle, Struct* to, Function function) noexcept {
  if (handle == nullptr || to == nullptr) return POLYGMAP_E_NULL;
  const Instance* instance = alive(handle);
  if (instance == nullptr) return POLYGMAP_E_INSTANCE;
  if (to->size != sizeof(Struct)) return POLYGMAP_E_SIZE;
  return function(*instance, *to) ? POLYGMAP_OK : POLYGMAP_E_NONE;
}

int stamped(bool taken) noexcept { return taken ? POLYGMAP_OK : POLYGMAP_E_STAMP; }

polygmap::Vec3 vector_of(const double* xyz) noexcept { return {xyz[0], xyz[1], xyz[2]}; }
polygmap::JointVector joints_of(const double* joints) noexcept { return polygmap::JointVector(joints); }

}  // namespace

const char* polygmap_version(void) { return POLYGMAP_VERSION_TEXT; }

const char* polygmap_error_text(int error) {
  switch (error) {
    case POLYGMAP_OK:
      return "No error.";
    case POLYGMAP_E_NULL:
      return "A pointer that must point to something is NULL.";
    case POLYGMAP_E_SIZE:
      return "The size that a struct begins with is not that of this version of the library.";
    case POLYGMAP_E_ALIGNMENT:
      return "The memory is not aligned to POLYGMAP_ALIGNMENT, 64 bytes.";
    case POLYGMAP_E_MEMORY:
      return "The memory is smaller than polygmap_memory_size().";
    case POLYGMAP_E_CONFIG:
      return "The configuration cannot be used; polygmap_create_error() says where and why.";
    case POLYGMAP_E_INSTANCE:
      return "There is no instance at that place: none was made there, or it was destroyed.";
    case POLYGMAP_E_STAMP:
      return "A stamp is out of order: not after the one before, or far from the time of the last step.";
    case POLYGMAP_E_PICTURE:
      return "The picture has another size than the camera of the configuration.";
    case POLYGMAP_E_OPERATE:
      return "There is no operation of that number.";
    case POLYGMAP_E_FULL:
      return "Too many operations wait for a step.";
    case POLYGMAP_E_NONE:
      return "There is nothing of that kind, or not yet.";
    case POLYGMAP_E_PLACE:
      return "That is no place to go to: it is not a number, farther than 50 m, or turned by more than 3.2 rad.";
    default:
      return "This is no error of this library.";
  }
}

size_t polygmap_memory_size(void) { return sizeof(Instance); }

int polygmap_create(polygmap_handle** out, void* memory, size_t bytes, const char* config) {
  if (out == nullptr) return POLYGMAP_E_NULL;
  *out = nullptr;
  if (memory == nullptr) return POLYGMAP_E_NULL;
  if (std::bit_cast<std::uintptr_t>(memory) % POLYGMAP_ALIGNMENT != 0) return POLYGMAP_E_ALIGNMENT;
  if (bytes < sizeof(Instance)) return POLYGMAP_E_MEMORY;
  ::new (memory) Instance;  // there is nobody to own it: its end is the memory's
  auto* instance = std::launder(static_cast<Instance*>(memory));
  if (!instance->try_begin(config)) {
    instance->mark = Mark::kFailed;
    return POLYGMAP_E_CONFIG;
  }
  instance->mark = Mark::kAlive;
  *out = reinterpret_cast<polygmap_handle*>(instance);
  return POLYGMAP_OK;
}

const char* polygmap_create_error(const void* memory) {
  const auto* instance = static_cast<const Instance*>(memory);
  return instance != nullptr && instance->mark == Mark::kFailed ? instance->wrong.c_str() : "";
}

void polygmap_destroy(polygmap_handle* handle) {
  if (handle != nullptr && alive(handle) != nullptr) alive(handle)->mark = Mark::kNone;
}

int polygmap_push_imu(polygmap_handle* handle, const polygmap_imu* sample) {
  return push(handle, sample, [](Instance& instance, const polygmap_imu& from) noexcept {
    return stamped(
        instance.imu.queue.try_push({from.stamp_ns, vector_of(from.gyro_radps), vector_of(from.accel_mps2)}));
  });
}

int polygmap_push_joints(polygmap_handle* handle, const polygmap_joints* feedback) {
  return push(handle, feedback, [](Instance& instance, const polygmap_joints& from) noexcept {
    polygmap::JointFeedback joints;
    joints.stamp_ns = from.stamp_ns;
    joints.q_rad = joints_of(from.q_rad);
    joints.dq_radps = joints_of(from.dq_radps);
    joints.tau_nm = joints_of(from.tau_nm);
    polygmap::link::PushedJoints::Drives drives;
    drives.errors = polygmap::JointSet::of_bits(from.drive_errors);
    drives.refused = polygmap::JointSet::of_bits(from.refused_joints);
    for (std::size_t n = 0; n < POLYGMAP_JOINTS; ++n) {
      joints.silent_cycles[n] = from.silent_cycles[n];
      drives.degc[n] = from.drive_degc[n];
    }
    for (std::size_t foot = 0; foot < POLYGMAP_FEET; ++foot) joints.foot_force_n[foot] = from.foot_force_n[foot];
    return stamped(instance.joints.try_push(joints, drives));
  });
}

int polygmap_push_lio(polygmap_handle* handle, const polygmap_lio* pose) {
  return push(handle, pose, [](Instance& instance, const polygmap_lio& from) noexcept {
    polygmap::LioSample sample;
    sample.stamp_ns = from.stamp_ns;
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) {
        sample.lio_T_lidar.R(row, column) = from.lio_R_lidar[3 * row + column];
      }
    }
    sample.lio_T_lidar.p_m = vector_of(from.lio_p_lidar_m);
    sample.position_sigma_m = vector_of(from.position_sigma_m);
    sample.rotation_sigma_rad = vector_of(from.rotation_sigma_rad);
    return stamped(instance.lio.queue.try_push(sample));
  });
}

int polygmap_rotation_of(const double wxyz[4], double rotation[9]) {
  if (wxyz == nullptr || rotation == nullptr) return POLYGMAP_E_NULL;
  const Eigen::Quaterniond q(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
  const double length = q.norm();
  if (!(length > 1e-9 && length < 1e9)) return POLYGMAP_E_NONE;
  const polygmap::Mat3 R = q.normalized().toRotationMatrix();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) rotation[3 * row + column] = R(row, column);
  }
  return POLYGMAP_OK;
}

int polygmap_push_depth(polygmap_handle* handle, const polygmap_depth* picture) {
  return push(handle, picture, [](Instance& instance, const polygmap_depth& from) noexcept -> int {
    if (from.pixels == nullptr) return POLYGMAP_E_NULL;
    const polygmap::CameraIntrinsics camera = instance.depth.intrinsics();
    if (from.width_px != camera.width_px || from.height_px != camera.height_px) return POLYGMAP_E_PICTURE;
    return stamped(instance.depth.try_push({from.stamp_ns, from.sequence, from.width_px, from.height_px, from.pixels}));
  });
}

int polygmap_step(polygmap_handle* handle, int64_t now_ns) {
  if (handle == nullptr) return POLYGMAP_E_NULL;
  Instance* instance = alive(handle);
  return instance == nullptr ? POLYGMAP_E_INSTANCE : stamped(instance->try_step(now_ns));
}

int polygmap_operate(polygmap_handle* handle, int command) {
  using polygmap::OperatorCommand;
  static_assert(POLYGMAP_OPERATE_GO_TO - POLYGMAP_OPERATE_ARM == static_cast<int>(OperatorCommand::kGoTo));
  if (handle == nullptr) return POLYGMAP_E_NULL;
  Instance* instance = alive(handle);
  if (instance == nullptr) return POLYGMAP_E_INSTANCE;
  if (command < POLYGMAP_OPERATE_ARM || command > POLYGMAP_OPERATE_HAND_OVER) return POLYGMAP_E_OPERATE;
  const auto asked = static_cast<OperatorCommand>(command - POLYGMAP_OPERATE_ARM);
  return instance->operations.try_push(asked) ? POLYGMAP_OK : POLYGMAP_E_FULL;
}

int polygmap_go_to(polygmap_handle* handle, double ahead_m, double left_m, double turn_rad, double up_m) {
  if (handle == nullptr) return POLYGMAP_E_NULL;
  Instance* instance = alive(handle);
  if (instance == nullptr) return POLYGMAP_E_INSTANCE;
  const bool has_turn = !std::isnan(turn_rad), has_height = !std::isnan(up_m);
  const polygmap::Destination to{ahead_m,   left_m, has_turn ? turn_rad : 0.0, has_turn, has_height ? up_m : 0.0,
                                 has_height};
  if (!to.is_valid()) return POLYGMAP_E_PLACE;
  return instance->operations.try_push(polygmap::OperatorRequest(to)) ? POLYGMAP_OK : POLYGMAP_E_FULL;
}

int polygmap_read_command(const polygmap_handle* handle, polygmap_command* command) {
  return read(handle, command, polygmap::link::read_command);
}
int polygmap_read_pose(const polygmap_handle* handle, polygmap_pose* pose) {
  return read(handle, pose, polygmap::link::read_pose);
}
int polygmap_read_status(const polygmap_handle* handle, polygmap_status* status) {
  return read(handle, status, polygmap::link::read_status);
}
int polygmap_read_faults(const polygmap_handle* handle, polygmap_faults* faults) {
  return read(handle, faults, polygmap::link::read_faults);
}
int polygmap_read_plan(const polygmap_handle* handle, polygmap_plan* plan) {
  return read(handle, plan, polygmap::link::read_plan);
}
