// SPDX-License-Identifier: Apache-2.0
// A CAN interface made up behind the system calls, as the kernel's raw sockets behave: for machines without one, and
// for what a virtual one never does. One lives at a time.
#pragma once

#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <deque>
#include <vector>

#include "hal/linux/system/system_calls.hpp"
#include "hal/ports/can_channel.hpp"

namespace polygmap::test {

class FakeCan {
 public:
  struct Raw {
    canfd_frame frame{};
    std::size_t size = CAN_MTU;
  };
  FakeCan() { active() = this; }
  ~FakeCan() { active() = nullptr; }
  FakeCan(const FakeCan&) = delete;
  FakeCan& operator=(const FakeCan&) = delete;

  bool present = true;  // the interface exists
  bool up = true;
  int mtu = CANFD_MTU;
  std::size_t room = 1000;    // of the queue of frames to send
  std::uint32_t dropped = 0;  // by the kernel, ever
  std::vector<Raw> sent;
  int pending_error = 0;  // the socket's, told once

  [[nodiscard]] static Raw raw_of(const hal::CanFrame& frame) {
    Raw raw;
    raw.frame.can_id = frame.id | (frame.extended ? CAN_EFF_FLAG : 0U) | (frame.error ? CAN_ERR_FLAG : 0U);
    raw.frame.len = frame.length;
    std::copy_n(frame.data.begin(), frame.length, static_cast<std::uint8_t*>(raw.frame.data));
    raw.size = frame.fd ? CANFD_MTU : CAN_MTU;
    return raw;
  }
  [[nodiscard]] static hal::CanFrame frame_of(const Raw& raw) {
    hal::CanFrame frame;
    frame.extended = (raw.frame.can_id & CAN_EFF_FLAG) != 0;
    frame.id = raw.frame.can_id & CAN_EFF_MASK;
    frame.length = raw.frame.len;
    frame.fd = raw.size == CANFD_MTU;
    std::copy_n(static_cast<const std::uint8_t*>(raw.frame.data), raw.frame.len, frame.data.begin());
    return frame;
  }
  // As the kernel filters: what the socket did not ask for does not reach it.
  void arrive(const Raw& raw) {
    if (!bound_) return;
    const canid_t id = raw.frame.can_id;
    bool wanted = false;
    if ((id & CAN_ERR_FLAG) != 0) {
      wanted = (id & error_mask_ & CAN_ERR_MASK) != 0;
    } else {
      for (const can_filter& f : filters_) wanted = wanted || (id & f.can_mask) == (f.can_id & f.can_mask);
    }
    if (wanted && (raw.size != CANFD_MTU || fd_)) waiting_.push_back(raw);
  }
  void arrive(const hal::CanFrame& frame) { arrive(raw_of(frame)); }
  // The adapter is pulled out: the socket is told, once, and is bound no more.
  void pull_out() {
    present = bound_ = false;
    pending_error = ENODEV;
    waiting_.clear();
  }

  [[nodiscard]] static const hal::SystemCalls& calls() {
    static const hal::SystemCalls kCalls = [] {
      hal::SystemCalls c = hal::kernel_calls();
      c.socket = [](int, int, int) noexcept {
        FakeCan& can = *active();
        can.filters_ = {{0, 0}};
        can.error_mask_ = 0;
        can.fd_ = can.bound_ = false;
        can.waiting_.clear();
        can.pending_error = 0;
        return 100;
      };
      c.close = [](int) noexcept {
        active()->bound_ = false;
        return 0;
      };
      c.ioctl = [](int, unsigned long request, void* argument) noexcept {
        FakeCan& can = *active();
        auto& r = *static_cast<ifreq*>(argument);
        if (!can.present || std::strcmp(static_cast<const char*>(r.ifr_name), "can0") != 0) return fail(ENODEV);
        if (request == SIOCGIFINDEX) r.ifr_ifindex = 4;
        if (request == SIOCGIFFLAGS) r.ifr_flags = can.up ? IFF_UP : 0;
        if (request == SIOCGIFMTU) r.ifr_mtu = can.mtu;
        return 0;
      };
      c.setsockopt = [](int, int level, int option, const void* value, socklen_t size) noexcept {
        FakeCan& can = *active();
        if (level == SOL_CAN_RAW && option == CAN_RAW_FILTER) {
          can.filters_.resize(size / sizeof(can_filter));
          std::memcpy(can.filters_.data(), value, size);
        }
        if (level == SOL_CAN_RAW && option == CAN_RAW_ERR_FILTER) std::memcpy(&can.error_mask_, value, size);
        if (level == SOL_CAN_RAW && option == CAN_RAW_FD_FRAMES) can.fd_ = true;
        return 0;
      };
      c.bind = [](int, const sockaddr* address, socklen_t) noexcept {
        if (!active()->present || reinterpret_cast<const sockaddr_can*>(address)->can_ifindex != 4) return fail(ENODEV);
        active()->bound_ = true;
        return 0;
      };
      c.recvmmsg = [](int, mmsghdr* messages, unsigned count, int) noexcept {
        return active()->receive(messages, count);
      };
      c.sendmmsg = [](int, mmsghdr* messages, unsigned count, int) noexcept { return active()->send(messages, count); };
      return c;
    }();
    return kCalls;
  }

 private:
  static FakeCan*& active() {
    static FakeCan* one = nullptr;
    return one;
  }
  static int fail(int error_number) noexcept {
    errno = error_number;
    return -1;
  }
  int receive(mmsghdr* messages, unsigned count) noexcept {
    if (pending_error != 0) return fail(std::exchange(pending_error, 0));
    if (waiting_.empty()) return fail(EAGAIN);
    unsigned n = 0;
    for (; n < count && !waiting_.empty(); ++n) {
      msghdr& h = messages[n].msg_hdr;
      const std::size_t size = std::min(waiting_.front().size, h.msg_iov->iov_len);
      std::memcpy(h.msg_iov->iov_base, &waiting_.front().frame, std::min(size, sizeof(canfd_frame)));
      messages[n].msg_len = static_cast<unsigned>(size);
      h.msg_flags = waiting_.front().size > size ? MSG_TRUNC : 0;
      waiting_.pop_front();
      timespec now{};
      ::clock_gettime(CLOCK_REALTIME, &now);
      cmsghdr* c = CMSG_FIRSTHDR(&h);
      *c = {.cmsg_len = CMSG_LEN(sizeof(now)), .cmsg_level = SOL_SOCKET, .cmsg_type = SCM_TIMESTAMPNS};
      std::memcpy(CMSG_DATA(c), &now, sizeof(now));
      c = reinterpret_cast<cmsghdr*>(static_cast<std::uint8_t*>(h.msg_control) + CMSG_SPACE(sizeof(now)));
      *c = {.cmsg_len = CMSG_LEN(sizeof(dropped)), .cmsg_level = SOL_SOCKET, .cmsg_type = SO_RXQ_OVFL};
      std::memcpy(CMSG_DATA(c), &dropped, sizeof(dropped));
      h.msg_controllen = CMSG_SPACE(sizeof(now)) + CMSG_SPACE(sizeof(dropped));
    }
    return static_cast<int>(n);
  }
  int send(mmsghdr* messages, unsigned count) noexcept {
    if (!bound_) return fail(ENXIO);
    if (!up) return fail(ENETDOWN);
    if (room == 0) return fail(ENOBUFS);
    unsigned n = 0;
    for (; n < count && room > 0; ++n, --room) {
      Raw raw;
      raw.size = messages[n].msg_hdr.msg_iov->iov_len;
      std::memcpy(&raw.frame, messages[n].msg_hdr.msg_iov->iov_base, raw.size);
      sent.push_back(raw);
      messages[n].msg_len = static_cast<unsigned>(raw.size);
    }
    return static_cast<int>(n);
  }

  std::vector<can_filter> filters_;
  can_err_mask_t error_mask_ = 0;
  bool fd_ = false;
  bool bound_ = false;
  std::deque<Raw> waiting_;
};

}  // namespace polygmap::test
