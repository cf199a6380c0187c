// SPDX-License-Identifier: Apache-2.0
// A depth camera over Video4Linux2, in the kernel's own buffers (docs/drivers.md has what each error does).
#pragma once

#include <linux/videodev2.h>

#include <array>
#include <cstdint>

#include "hal/linux/buffer_book.hpp"
#include "hal/linux/system/descriptor.hpp"
#include "hal/linux/system/device_error.hpp"
#include "hal/ports/depth_camera.hpp"

namespace polygmap::hal {

class V4l2Camera final : public DepthCamera {
 public:
  enum class PixelFormat : std::uint8_t { kZ16, kY16 };  // both: 16 bits, little-endian, 0 invalid
  struct Config {
    FixedText<63> device{};         // "/dev/video2"
    CameraIntrinsics intrinsics{};  // width, height and what no V4L2 call tells
    PixelFormat format = PixelFormat::kZ16;
    std::uint32_t buffers = 8;              // 4 to BufferBook::kMostBuffers
    std::uint32_t frames_per_s = 0;         // that the device must give; 0: its own
    std::int64_t latency_ns = 0;            // from the end of the exposure to the device's stamp
    std::int64_t exposure_ns = 0;           // the stamp given is the middle of it
    std::int64_t timeout_ns = 500'000'000;  // without a picture: the stream is opened anew
  };
  struct Counters {  // saturate
    std::uint32_t good = 0;
    std::uint32_t flagged = 0;      // pictures that the driver marked as faulty
    std::uint32_t short_ones = 0;   // pictures of another size
    std::uint32_t wrong_stamp = 0;  // stamps that do not increase, or of another clock
    std::uint32_t missing = 0;      // pictures that the kernel numbered and never gave
    std::uint32_t pushed_out = 0;   // good pictures that nobody acquired
    std::uint32_t timeouts = 0;
    std::uint32_t io_errors = 0;  // EIO of a picture
    std::uint32_t interrupted = 0;
    std::uint32_t failed_calls = 0;  // any other errno, and answers that cannot be
  };

  explicit V4l2Camera(const SystemCalls& calls = kernel_calls()) noexcept : calls_(calls) {}
  ~V4l2Camera() { close(); }
  V4l2Camera(const V4l2Camera&) = delete;
  V4l2Camera& operator=(const V4l2Camera&) = delete;
  [[nodiscard]] DeviceError open(const Config& config) noexcept;
  // Views that are held end here.
  void close() noexcept;
  // Opens a stream anew that was lost; each call tries once. Outside the lanes: a camera may take seconds.
  void maintain() noexcept;

  [[nodiscard]] CameraIntrinsics intrinsics() const noexcept override { return config_.intrinsics; }
  // The kernel drops the newest picture when all its buffers are full. So that the oldest is pushed out instead, this
  // or poll() must be called once a picture, also while one is held.
  [[nodiscard]] bool try_acquire(DepthFrameView& frame) noexcept override;
  void release() noexcept override;
  void poll() noexcept;

  // What the module holds, for a second holder in the module's lane; kept until release_shared() of its pixels.
  [[nodiscard]] bool try_share() noexcept { return book_.share(); }
  void release_shared(const std::uint16_t* pixels) noexcept;

  [[nodiscard]] bool is_lost() const noexcept { return owner_.is_lost(); }
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }
  [[nodiscard]] const ReopenCounters& reopen_counters() const noexcept { return reopens_; }

 private:
  struct Mapping {
    void* address = nullptr;
    std::size_t size = 0;
  };
  static constexpr std::uint32_t kMostIoErrors = 3;  // in a row: then the stream is given up

  [[nodiscard]] DeviceError open_stream() noexcept;
  [[nodiscard]] DeviceError set_format(int fd) noexcept;
  [[nodiscard]] DeviceError set_rate(int fd) noexcept;
  [[nodiscard]] DeviceError map_buffers(int fd) noexcept;
  [[nodiscard]] DeviceError start(int fd) noexcept;
  void unmap() noexcept;
  // An ioctl, again after EINTR.
  [[nodiscard]] int call(int fd, unsigned long request, void* argument) noexcept;
  // One filled buffer of the kernel's. What says that the lane gave the stream up says it last: from then on the device
  // may be maintain()'s.
  enum class Dequeued : std::uint8_t { kPicture, kNone, kGivenUp };
  [[nodiscard]] Dequeued dequeue(v4l2_buffer& buffer) noexcept;
  // False: given up.
  [[nodiscard]] bool poll_stream() noexcept;
  [[nodiscard]] bool take(const v4l2_buffer& buffer) noexcept;
  [[nodiscard]] bool hand_back(std::uint32_t index) noexcept;
  void give_back(std::optional<BufferBook::Index> buffer) noexcept;
  [[nodiscard]] std::int64_t now_ns() noexcept;
  // At once, or as soon as nobody holds a picture of it.
  void give_up() noexcept;

  const SystemCalls& calls_;
  Config config_;
  DeviceOwner owner_;
  Descriptor device_;
  std::array<Mapping, BufferBook::kMostBuffers> mappings_{};
  std::uint32_t image_bytes_ = 0;
  BufferBook book_;
  bool given_up_ = false;  // the lane's: lost, while a picture is held
  std::uint32_t io_errors_in_a_row_ = 0;
  struct {
    std::int64_t heard_ns = 0;  // of the last picture, or of the start
    std::int64_t stamp_ns = INT64_MIN;
    std::uint32_t sequence = 0;  // as given out
    std::uint32_t kernel = 0;    // as the kernel numbers
    bool numbered = false;       // kernel is of this stream
  } last_;
  Counters counters_;
  ReopenCounters reopens_;
};

}  // namespace polygmap::hal
