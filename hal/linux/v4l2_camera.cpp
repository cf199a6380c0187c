// SPDX-License-Identifier: Apache-2.0
#include "hal/linux/v4l2_camera.hpp"

#include <fcntl.h>
#include <sys/mman.h>

#include <algorithm>
#include <cerrno>

#include "algorithms/core/time.hpp"

namespace polygmap::hal {
namespace {

[[nodiscard]] std::uint32_t code_of(V4l2Camera::PixelFormat format) noexcept {
  return format == V4l2Camera::PixelFormat::kZ16 ? V4L2_PIX_FMT_Z16 : V4L2_PIX_FMT_Y16;
}
[[nodiscard]] const char* name_of(V4l2Camera::PixelFormat format) noexcept {
  return format == V4l2Camera::PixelFormat::kZ16 ? "Z16" : "Y16";
}
[[nodiscard]] v4l2_buffer capture_buffer(std::uint32_t index) noexcept {
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.index = index;
  return buffer;
}
[[nodiscard]] bool is_monotonic(const v4l2_buffer& buffer) noexcept {
  return (buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
}

}  // namespace

DeviceError V4l2Camera::open(const Config& config) noexcept {
  close();
  const char* name = config.device.c_str();
  if (config.device.empty() || config.device.too_long()) {
    return device_error(DeviceErrorKind::kConfiguration, "depth camera", "a device's path has 1 to 63 characters");
  }
  const CameraIntrinsics& i = config.intrinsics;
  if (i.width_px < 1 || i.width_px > kDepthWidth_px || i.height_px < 1 || i.height_px > kDepthHeight_px) {
    return device_error(DeviceErrorKind::kConfiguration, name, "%dx%d pixels: the module takes 1x1 to %dx%d",
                        i.width_px, i.height_px, kDepthWidth_px, kDepthHeight_px);
  }
  if (config.buffers < 4 || config.buffers > BufferBook::kMostBuffers) {
    return device_error(DeviceErrorKind::kConfiguration, name, "%u buffers: 4 to %zu are needed", config.buffers,
                        BufferBook::kMostBuffers);
  }
  config_ = config;
  DeviceError error = open_stream();
  if (!error.failed()) owner_.set_open();
  return error;
}

void V4l2Camera::close() noexcept {
  owner_.set_closed();
  unmap();
  device_.close();
  book_.reset(4);
}

void V4l2Camera::maintain() noexcept {
  if (!owner_.is_lost()) return;
  unmap();
  device_.close();  // which stops the stream
  if (open_stream().failed()) {
    unmap();
    device_.close();
    reopens_.failed.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  reopens_.reopened.fetch_add(1, std::memory_order_relaxed);
  owner_.set_open();
}

void V4l2Camera::unmap() noexcept {
  for (Mapping& mapping : mappings_) {
    if (mapping.address != nullptr) static_cast<void>(calls_.munmap(mapping.address, mapping.size));
    mapping = {};
  }
}

int V4l2Camera::call(int fd, unsigned long request, void* argument) noexcept {
  int answer = -1;
  for (int attempt = 0; attempt <= kInterruptedRetries; ++attempt) {
    answer = calls_.ioctl(fd, request, argument);
    if (answer == 0 || errno != EINTR) break;
  }
  return answer;
}

DeviceError V4l2Camera::open_stream() noexcept {
  const char* name = config_.device.c_str();
  Descriptor device(calls_, calls_.open(name, O_RDWR | O_NONBLOCK | O_CLOEXEC));
  if (!device.valid()) return system_error(name, "cannot open", errno);
  v4l2_capability capability{};
  if (call(device.get(), VIDIOC_QUERYCAP, &capability) != 0) return system_error(name, "is no video device", errno);
  const std::uint32_t can =
      (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? capability.device_caps : capability.capabilities;
  if ((can & V4L2_CAP_VIDEO_CAPTURE) == 0 || (can & V4L2_CAP_STREAMING) == 0) {
    return device_error(DeviceErrorKind::kUnsuitable, name, "does not stream pictures");
  }
  DeviceError error = set_format(device.get());
  if (!error.failed()) error = set_rate(device.get());
  if (!error.failed()) error = map_buffers(device.get());
  if (!error.failed()) error = start(device.get());
  if (error.failed()) {
    unmap();
    return error;
  }
  device_ = std::move(device);
  return {};
}

DeviceError V4l2Camera::set_format(int fd) noexcept {
  const char* name = config_.device.c_str();
  const auto width = static_cast<std::uint32_t>(config_.intrinsics.width_px);
  const auto height = static_cast<std::uint32_t>(config_.intrinsics.height_px);
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  v4l2_pix_format& pixels = format.fmt.pix;
  pixels.width = width;
  pixels.height = height;
  pixels.pixelformat = code_of(config_.format);
  pixels.field = V4L2_FIELD_NONE;
  if (call(fd, VIDIOC_S_FMT, &format) != 0) return system_error(name, "cannot set the picture's format", errno);
  if (pixels.width != width || pixels.height != height || pixels.pixelformat != code_of(config_.format)) {
    return device_error(DeviceErrorKind::kUnsuitable, name, "gives no %ux%u %s but %ux%u of another format or size",
                        width, height, name_of(config_.format), pixels.width, pixels.height);
  }
  if (pixels.bytesperline != 2 * width) {
    return device_error(DeviceErrorKind::kUnsuitable, name, "pads a row of %u pixels to %u bytes", width,
                        pixels.bytesperline);
  }
  image_bytes_ = 2 * width * height;
  return {};
}

DeviceError V4l2Camera::set_rate(int fd) noexcept {
  if (config_.frames_per_s == 0) return {};
  v4l2_streamparm rate{};
  rate.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  rate.parm.capture.timeperframe = {1, config_.frames_per_s};
  if (call(fd, VIDIOC_S_PARM, &rate) != 0) {
    return system_error(config_.device.c_str(), "cannot set the pictures per second", errno);
  }
  // A device takes what is nearest, or does not care. 30 may be 29.97.
  const v4l2_fract& taken = rate.parm.capture.timeperframe;
  const double taken_per_s = taken.numerator > 0 ? static_cast<double>(taken.denominator) / taken.numerator : 0.0;
  if (!(taken_per_s > 0.99 * config_.frames_per_s && taken_per_s < 1.01 * config_.frames_per_s)) {
    return device_error(DeviceErrorKind::kUnsuitable, config_.device.c_str(),
                        "gives %.2f pictures a second instead of %u", taken_per_s, config_.frames_per_s);
  }
  return {};
}

DeviceError V4l2Camera::map_buffers(int fd) noexcept {
  const char* name = config_.device.c_str();
  v4l2_requestbuffers request{};
  request.count = config_.buffers;
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  if (call(fd, VIDIOC_REQBUFS, &request) != 0) return system_error(name, "cannot get buffers", errno);
  if (request.count < 4) {
    return device_error(DeviceErrorKind::kUnsuitable, name, "gives %u buffers of the 4 that are needed", request.count);
  }
  // A driver may give more than asked for. Those are never handed to it.
  const std::uint32_t count = std::min(request.count, config_.buffers);
  for (std::uint32_t i = 0; i < count; ++i) {
    v4l2_buffer buffer = capture_buffer(i);
    if (call(fd, VIDIOC_QUERYBUF, &buffer) != 0) return system_error(name, "cannot look at a buffer", errno);
    if (!is_monotonic(buffer)) {
      return device_error(DeviceErrorKind::kUnsuitable, name, "does not stamp pictures in the monotonic clock");
    }
    if (buffer.length < image_bytes_) {
      return device_error(DeviceErrorKind::kUnsuitable, name, "gives buffers of %u bytes for pictures of %u",
                          buffer.length, image_bytes_);
    }
    void* address = calls_.mmap(buffer.length, PROT_READ, MAP_SHARED, fd, static_cast<off_t>(buffer.m.offset));
    if (address == MAP_FAILED) return system_error(name, "cannot map a buffer", errno);
    mappings_[i] = {address, buffer.length};
  }
  return {};
}

DeviceError V4l2Camera::start(int fd) noexcept {
  const char* name = config_.device.c_str();
  std::uint32_t count = 0;
  for (; count < mappings_.size() && mappings_[count].address != nullptr; ++count) {
    v4l2_buffer buffer = capture_buffer(count);
    if (call(fd, VIDIOC_QBUF, &buffer) != 0) return system_error(name, "cannot hand over a buffer", errno);
  }
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (call(fd, VIDIOC_STREAMON, &type) != 0) return system_error(name, "cannot start the stream", errno);
  book_.reset(count);
  given_up_ = false;
  io_errors_in_a_row_ = 0;
  last_.numbered = false;
  last_.heard_ns = now_ns();
  return {};
}

std::int64_t V4l2Camera::now_ns() noexcept {
  timespec time{};
  if (calls_.clock_gettime(CLOCK_MONOTONIC, &time) != 0) return last_.heard_ns;
  return time.tv_sec * kNsPerS + time.tv_nsec;
}

void V4l2Camera::give_up() noexcept {
  given_up_ = true;
  book_.forget_waiting();
  if (!book_.any_held()) owner_.set_lost();  // the last that the lane does to the device
}

V4l2Camera::Dequeued V4l2Camera::dequeue(v4l2_buffer& buffer) noexcept {
  int error = EINTR;
  for (int attempt = 0; error == EINTR && attempt <= kInterruptedRetries; ++attempt) {
    buffer = capture_buffer(0);
    error = calls_.ioctl(device_.get(), VIDIOC_DQBUF, &buffer) == 0 ? 0 : errno;
    if (error == EINTR) count_up(counters_.interrupted);
  }
  switch (error) {
    case 0:
      io_errors_in_a_row_ = 0;
      return Dequeued::kPicture;
    case EINTR:
    case EAGAIN:
      return Dequeued::kNone;
    case EIO:
      count_up(counters_.io_errors);
      if (++io_errors_in_a_row_ < kMostIoErrors) return Dequeued::kNone;
      break;
    default:
      count_up(counters_.failed_calls);
      break;
  }
  give_up();
  return Dequeued::kGivenUp;
}

bool V4l2Camera::hand_back(std::uint32_t index) noexcept {
  v4l2_buffer buffer = capture_buffer(index);
  if (call(device_.get(), VIDIOC_QBUF, &buffer) == 0) return true;
  count_up(counters_.failed_calls);
  give_up();
  return false;
}

bool V4l2Camera::poll_stream() noexcept {
  // No more than there are buffers: a driver that fills them at once must not hold the lane.
  for (std::size_t i = 0; i < mappings_.size(); ++i) {
    v4l2_buffer buffer{};
    const Dequeued answer = dequeue(buffer);
    if (answer == Dequeued::kGivenUp) return false;
    if (answer == Dequeued::kNone) break;
    if (buffer.index >= mappings_.size() || mappings_[buffer.index].address == nullptr) {
      count_up(counters_.failed_calls);
      give_up();
      return false;
    }
    last_.heard_ns = now_ns();
    if (!take(buffer)) return false;
  }
  if (now_ns() - last_.heard_ns <= config_.timeout_ns) return true;
  count_up(counters_.timeouts);
  give_up();
  return false;
}

void V4l2Camera::poll() noexcept {
  if (owner_.is_open() && !given_up_) static_cast<void>(poll_stream());
}

bool V4l2Camera::take(const v4l2_buffer& buffer) noexcept {
  const std::uint32_t step = buffer.sequence - last_.kernel;
  const bool ahead = last_.numbered && step > 0 && step < UINT32_MAX / 2;
  if (ahead) count_up(counters_.missing, step - 1);
  last_.sequence += ahead ? step : 1;
  last_.numbered = true;
  last_.kernel = buffer.sequence;
  const std::int64_t half_ns = config_.exposure_ns / 2;
  const bool at_start = (buffer.flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  const std::int64_t stamp_ns = buffer.timestamp.tv_sec * kNsPerS + buffer.timestamp.tv_usec * 1000 -
                                config_.latency_ns + (at_start ? half_ns : -half_ns);
  std::uint32_t* bad = nullptr;
  if ((buffer.flags & V4L2_BUF_FLAG_ERROR) != 0) {
    bad = &counters_.flagged;
  } else if (buffer.bytesused != image_bytes_) {
    bad = &counters_.short_ones;
  } else if (!is_monotonic(buffer) || stamp_ns <= last_.stamp_ns) {
    bad = &counters_.wrong_stamp;
  }
  if (bad != nullptr) {
    count_up(*bad);
    return hand_back(buffer.index);
  }
  last_.stamp_ns = stamp_ns;
  count_up(counters_.good);
  const DepthFrameView view{stamp_ns, last_.sequence, config_.intrinsics.width_px, config_.intrinsics.height_px,
                            static_cast<const std::uint16_t*>(mappings_[buffer.index].address)};
  const auto pushed_out = book_.arrived(buffer.index, view);
  if (!pushed_out) return true;
  count_up(counters_.pushed_out);
  return hand_back(*pushed_out);
}

bool V4l2Camera::try_acquire(DepthFrameView& frame) noexcept {
  return owner_.is_open() && !given_up_ && poll_stream() && book_.take(frame);
}

void V4l2Camera::give_back(std::optional<BufferBook::Index> buffer) noexcept {
  if (!given_up_) {
    if (buffer) static_cast<void>(hand_back(*buffer));
  } else if (!book_.any_held()) {
    owner_.set_lost();
  }
}

void V4l2Camera::release() noexcept {
  if (owner_.is_open()) give_back(book_.give_back());
}
void V4l2Camera::release_shared(const std::uint16_t* pixels) noexcept {
  if (owner_.is_open()) give_back(book_.give_back_shared(pixels));
}

}  // namespace polygmap::hal
