// SPDX-License-Identifier: Apache-2.0
// The operator's socket, its client, and what becomes of a command that nobody hears in time.
#include "firmware/daemon/service/operator_socket.hpp"

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstring>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <limits>
#include <thread>

#include "tests/support/port_contract.hpp"

namespace polygmap {
namespace {

std::int64_t monotonic_ns() {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * kNsPerS + now.tv_nsec;
}
std::string path_of(const std::string& name) {
  return testing::TempDir() + "polygmap_" + name + "_" + std::to_string(::getpid());
}
sockaddr_un address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  return address;
}
const sockaddr* generic(const sockaddr_un& address) { return reinterpret_cast<const sockaddr*>(&address); }

// Who asks, and does not wait.
class Client {
 public:
  explicit Client(const std::string& path) : to_(address_of(path)) {
    sockaddr_un own{};
    own.sun_family = AF_UNIX;
    EXPECT_EQ(::bind(fd_, generic(own), sizeof(sa_family_t)), 0);
  }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;
  ~Client() { ::close(fd_); }

  void send(const std::string& text) const {
    EXPECT_EQ(::sendto(fd_, text.data(), text.size(), 0, generic(to_), sizeof to_), static_cast<ssize_t>(text.size()));
  }
  // Empty: no answer is there.
  [[nodiscard]] std::string heard() const {
    std::array<char, 512> text{};
    const auto got = ::recv(fd_, text.data(), text.size(), MSG_DONTWAIT);
    return got < 0 ? std::string() : std::string(text.data(), static_cast<std::size_t>(got));
  }

 private:
  const int fd_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_un to_;
};

}  // namespace

namespace contract {
namespace {

struct OperatorSocketHarness {
  const std::string path = path_of("contract");
  daemon::OperatorSocket socket;
  const bool opened = socket.open(path).empty();
  const Client client{path};

  hal::OperatorInput& port() {
    EXPECT_TRUE(opened);
    // Two looks after an answer, and one for what was asked next.
    for (int look = 0; look < 3; ++look) socket.serve(ModuleState::kSafeStop, monotonic_ns());
    return socket;
  }
  void ask(OperatorCommand command) const {
    client.send(std::string(name_of(command)) + " " + std::to_string(monotonic_ns()));
  }
  std::string told() {
    (void)port();
    std::string last;
    for (std::string one = client.heard(); !one.empty(); one = client.heard()) last = one;
    return last;
  }
};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(ClockContract);  // the other ports are the drivers'
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(ImuContract);
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(LidarOdometryContract);
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(JointBusContract);
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(DepthCameraContract);
INSTANTIATE_TYPED_TEST_SUITE_P(Socket, OperatorInputContract, OperatorSocketHarness);

}  // namespace
}  // namespace contract

namespace daemon {
namespace {

TEST(OperatorSocketTest, NoSocketCanBeMade_IsTold) {
  OperatorSocket none, file, first, second;
  EXPECT_NE(none.open("/nowhere/operator").find("cannot be made"), std::string::npos);
  EXPECT_NE(none.open(std::string(200, 'x')).find("too long"), std::string::npos);
  const std::string path = testing::TempDir() + "polygmap_no_socket_" + std::to_string(::getpid());
  std::ofstream(path) << "mine";
  EXPECT_NE(file.open(path).find("cannot be made"), std::string::npos);
  EXPECT_TRUE(std::filesystem::is_regular_file(path)) << "what is no socket stays there";
  std::filesystem::remove(path);
  ASSERT_EQ(first.open(path), "");
  EXPECT_NE(second.open(path).find("cannot be made"), std::string::npos) << "another daemon lives there";
  std::string text;
  EXPECT_FALSE(try_ask(path + "_", "state", text));
  EXPECT_NE(text.find("nobody listens at"), std::string::npos) << text;
}

// Whoever listens there is no datagram socket, so that connecting fails, and not for want of a listener.
TEST(OperatorSocketTest, AnotherKindOfSocketLivesThere_IsLeftAlone) {
  const std::string path = path_of("stream");
  const sockaddr_un address = address_of(path);
  const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  ASSERT_EQ(::bind(fd, generic(address), sizeof address), 0);
  ASSERT_EQ(::listen(fd, 1), 0);
  OperatorSocket socket;
  EXPECT_NE(socket.open(path).find("cannot be made"), std::string::npos);
  EXPECT_TRUE(std::filesystem::is_socket(path));
  ::close(fd);
  ::unlink(path.c_str());
}

TEST(OperatorSocketTest, FormerRunLeftItsSocket_IsReplaced) {
  const std::string path = path_of("left");
  const sockaddr_un address = address_of(path);
  const int fd = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  ASSERT_EQ(::bind(fd, generic(address), sizeof address), 0);
  ::close(fd);
  OperatorSocket socket;
  EXPECT_EQ(socket.open(path), "");
}

TEST(OperatorSocketTest, PlaceInFullPrecision_IsHeardWhole) {
  const std::string path = path_of("precise");
  OperatorSocket socket;
  ASSERT_EQ(socket.open(path), "");
  const Client client(path);
  const std::int64_t now_ns = std::numeric_limits<std::int64_t>::max() / 2;
  client.send("go_to=-1.2345678901234567e-100,-12.345678901234567,-123.45678901234567 " + std::to_string(now_ns) +
              "\n");
  socket.serve(ModuleState::kStanding, now_ns);
  OperatorRequest request;
  ASSERT_TRUE(socket.try_read(request)) << client.heard();
  EXPECT_EQ(request.destination.left_m, -12.345678901234567);
}

// The daemon's thread was held up while the word lay in the socket; whoever asked has gone by then.
TEST(OperatorSocketTest, WordThatWaitedForMoreThanHalfASecond_StartsNothing) {
  const std::string path = path_of("late");
  OperatorSocket socket;
  ASSERT_EQ(socket.open(path), "");
  const Client client(path);
  OperatorRequest request;
  for (const std::int64_t waited_ns : {400 * kNsPerMs, 600 * kNsPerMs}) {
    const std::int64_t sent_ns = monotonic_ns();
    client.send("start " + std::to_string(sent_ns));
    socket.serve(ModuleState::kStanding, sent_ns + waited_ns);
    EXPECT_EQ(socket.try_read(request), waited_ns < 500 * kNsPerMs);
    if (waited_ns < 500 * kNsPerMs) {
      socket.answer({});
      for (int look = 0; look < 2; ++look) socket.serve(ModuleState::kWalkingUp, sent_ns + waited_ns);
      EXPECT_EQ(client.heard(), "walking_up");
    } else {
      EXPECT_EQ(client.heard(), "refused: it was not heard within half a second");
    }
  }
}

// Half a second from the sending, though it was heard late.
TEST(OperatorSocketTest, ControlDoesNotTakeIt_IsDroppedHalfASecondAfterItWasSent) {
  const std::string path = path_of("untaken");
  OperatorSocket socket;
  ASSERT_EQ(socket.open(path), "");
  const Client client(path);
  const std::int64_t sent_ns = monotonic_ns();
  client.send("start " + std::to_string(sent_ns));
  socket.serve(ModuleState::kStanding, sent_ns + 400 * kNsPerMs);
  socket.serve(ModuleState::kStanding, sent_ns + 510 * kNsPerMs);
  EXPECT_EQ(client.heard(), "refused: control did not take it");
  OperatorRequest request;
  EXPECT_FALSE(socket.try_read(request));
}

TEST(OperatorSocketTest, WordWithoutItsTime_IsRefused) {
  const std::string path = path_of("timeless");
  OperatorSocket socket;
  ASSERT_EQ(socket.open(path), "");
  const Client client(path);
  OperatorRequest request;
  for (const char* text : {"start", "start ", "start now", "start 12x", "start -9223372036854775808",
                           "start 9223372036854775807", "start 99999999999999999999"}) {
    client.send(text);
    socket.serve(ModuleState::kStanding, monotonic_ns());
    EXPECT_TRUE(client.heard().starts_with("refused: ")) << text;
    EXPECT_FALSE(socket.try_read(request)) << text;
  }
  client.send("state");
  socket.serve(ModuleState::kStanding, monotonic_ns());
  EXPECT_EQ(client.heard(), "standing") << "it asks for nothing";
}

TEST(OperatorSocketTest, EveryJointIsNamed_ReachesTheClientWhole) {
  const OperatorAnswer answer{Refusal::kJointsAway, JointSet::all()};
  const AnswerText text = text_of(answer, ModuleState::kSafeStop);
  EXPECT_TRUE(text.view().ends_with("right_ankle_roll")) << text.view();
  const std::string path = path_of("whole");
  OperatorSocket socket;
  ASSERT_EQ(socket.open(path), "");
  std::string heard;
  std::thread client([&] { EXPECT_TRUE(try_ask(path, "reset", heard)); });
  OperatorRequest request;
  while (!socket.try_read(request)) socket.serve(ModuleState::kSafeStop, monotonic_ns());
  socket.answer(answer);
  for (int look = 0; look < 2; ++look) socket.serve(ModuleState::kSafeStop, monotonic_ns());
  client.join();
  EXPECT_EQ(heard, text.view());
}

}  // namespace
}  // namespace daemon
}  // namespace polygmap
