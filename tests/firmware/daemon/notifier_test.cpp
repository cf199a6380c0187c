// SPDX-License-Identifier: Apache-2.0
#include "firmware/daemon/system/notifier.hpp"

#include <gtest/gtest.h>

#include "tests/firmware/daemon/notify_socket.hpp"

namespace polygmap::daemon {
namespace {

using test::NotifySocket;

std::string unique(const char* name) { return name + std::to_string(::getpid()); }

TEST(Notifier, WithoutSocket_IsNoErrorAndTellsNothing) {
  for (const char* socket : {static_cast<const char*>(nullptr), ""}) {
    Notifier notifier;
    EXPECT_TRUE(notifier.open(socket, "1000000", nullptr));
    EXPECT_FALSE(notifier.is_open());
    EXPECT_FALSE(notifier.tell("READY=1"));
    EXPECT_EQ(notifier.watchdog_ns(), 0);
  }
}

TEST(Notifier, AbstractNameAndPath_ReceiveWhatIsTold) {
  for (const std::string& name : {unique("@polygmap_notifier_"), unique("/tmp/polygmap_notifier_")}) {
    NotifySocket manager(name);
    ASSERT_TRUE(manager.is_open()) << name;
    Notifier notifier;
    ASSERT_TRUE(notifier.open(name.c_str(), nullptr, nullptr));
    EXPECT_TRUE(notifier.tell("READY=1"));
    EXPECT_TRUE(notifier.tell("STATUS=arming"));
    EXPECT_EQ(manager.read(), (std::vector<std::string>{"READY=1", "STATUS=arming"})) << name;
  }
}

TEST(Notifier, NobodyListens_TellsFalseAndLivesOn) {
  Notifier notifier;
  ASSERT_TRUE(notifier.open("/tmp/polygmap_nobody_listens_here", nullptr, nullptr));
  EXPECT_FALSE(notifier.tell("READY=1"));
}

TEST(Notifier, ManagerThatDoesNotRead_NeverBlocks) {
  NotifySocket manager(unique("@polygmap_deaf_"));
  Notifier notifier;
  ASSERT_TRUE(notifier.open(manager.name().c_str(), nullptr, nullptr));
  int taken = 0;
  for (int i = 0; i < 10'000; ++i) taken += notifier.tell("STATUS=running") ? 1 : 0;
  EXPECT_GT(taken, 0);
  EXPECT_LT(taken, 10'000);
}

TEST(Notifier, NameThatIsNone_IsRefused) {
  const std::string longest(200, 'x');
  for (const std::string& name :
       {std::string("run/notify"), std::string("@"), "/" + longest, "vsock:2:1234" + longest}) {
    Notifier notifier;
    EXPECT_FALSE(notifier.open(name.c_str(), nullptr, nullptr)) << name;
  }
}

TEST(Notifier, Watchdog_IsOfThisProcessOnly) {
  NotifySocket manager(unique("@polygmap_dog_"));
  const std::string mine = std::to_string(::getpid()), another = std::to_string(::getpid() + 1);
  const auto watchdog_ns = [&](const char* us, const char* pid) {
    Notifier notifier;
    EXPECT_TRUE(notifier.open(manager.name().c_str(), us, pid));
    return notifier.watchdog_ns();
  };
  EXPECT_EQ(watchdog_ns("500000", mine.c_str()), 500'000'000);
  EXPECT_EQ(watchdog_ns("500000", nullptr), 500'000'000);
  EXPECT_EQ(watchdog_ns("500000", another.c_str()), 0);
  EXPECT_EQ(watchdog_ns(nullptr, mine.c_str()), 0);
  EXPECT_EQ(watchdog_ns("half a second", nullptr), 0);
  EXPECT_EQ(watchdog_ns("-5", nullptr), 0);
  EXPECT_EQ(watchdog_ns("9223372036854775807", nullptr), 0);
}

}  // namespace
}  // namespace polygmap::daemon
