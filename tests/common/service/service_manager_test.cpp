// SPDX-License-Identifier: Apache-2.0
// Against a real socket, as the service manager has one.
#include "common/service/service_manager.h"

#include "tests/temporary_folder.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>
#include <array>
#include <cstdlib>
#include <cstring>

namespace gyre {
namespace {

using namespace std::chrono_literals;

// Listens as a service manager does. name: "/path" or "@abstract".
class Manager {
 public:
  explicit Manager(const std::string& name) : fd_(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::memcpy(address.sun_path, name.data(), name.size());
    if (name[0] == '@') address.sun_path[0] = '\0';
    const std::size_t length = offsetof(sockaddr_un, sun_path) + name.size() + (name[0] == '@' ? 0 : 1);
    EXPECT_EQ(::bind(fd_, reinterpret_cast<const sockaddr*>(&address), static_cast<socklen_t>(length)), 0);
  }
  ~Manager() { ::close(fd_); }
  Manager(const Manager&) = delete;
  Manager& operator=(const Manager&) = delete;

  // What has come; a datagram over a local socket is there when its send has returned.
  std::string heard() const {
    std::array<char, 4096> block{};
    const ssize_t got = ::recv(fd_, block.data(), block.size(), 0);
    return got < 0 ? "nothing" : std::string(block.data(), static_cast<std::size_t>(got));
  }

 private:
  int fd_;
};

class ServiceManagerTest : public testing::Test {
 protected:
  ~ServiceManagerTest() override {
    for (const char* name : {"NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID"}) ::unsetenv(name);
  }
  TemporaryFolder folder_;
  const std::string path_ = (folder_.path() / "notify").string();
};

TEST_F(ServiceManagerTest, IsToldEverything) {
  for (const std::string& name : {path_, "@gyre-test-" + std::to_string(::getpid())}) {
    SCOPED_TRACE(name);
    const Manager manager(name);
    ::setenv("NOTIFY_SOCKET", name.c_str(), 1);
    const Result<ServiceManager> told = ServiceManager::from_environment();
    ASSERT_TRUE(told) << told.error().message();
    EXPECT_TRUE(told->is_there());
    EXPECT_TRUE(told->ready());
    EXPECT_EQ(manager.heard(), "READY=1");
    EXPECT_TRUE(told->status("recording: body\nREADY=1"));
    EXPECT_EQ(manager.heard(), "STATUS=recording: body");
    EXPECT_TRUE(told->alive());
    EXPECT_EQ(manager.heard(), "WATCHDOG=1");
    EXPECT_TRUE(told->stopping());
    EXPECT_EQ(manager.heard(), "STOPPING=1");
    EXPECT_EQ(manager.heard(), "nothing");
  }
}

TEST_F(ServiceManagerTest, IsNotInheritedByChildren) {
  const Manager manager(path_);
  ::setenv("NOTIFY_SOCKET", path_.c_str(), 1);
  ::setenv("WATCHDOG_USEC", "20000000", 1);
  ASSERT_TRUE(ServiceManager::from_environment());
  EXPECT_EQ(std::getenv("NOTIFY_SOCKET"), nullptr);
  EXPECT_EQ(std::getenv("WATCHDOG_USEC"), nullptr);
}

TEST_F(ServiceManagerTest, SaysHowOftenItWantsASign) {
  const Manager manager(path_);
  const auto watchdog = [&](const char* interval, const std::string& pid) {
    ::setenv("NOTIFY_SOCKET", path_.c_str(), 1);
    ::setenv("WATCHDOG_USEC", interval, 1);
    if (!pid.empty()) ::setenv("WATCHDOG_PID", pid.c_str(), 1);
    return ServiceManager::from_environment().value().watchdog();
  };
  EXPECT_EQ(watchdog("20000000", ""), 20s);
  EXPECT_EQ(watchdog("20000000", std::to_string(::getpid())), 20s);
  EXPECT_EQ(watchdog("20000000", std::to_string(::getpid() + 1)), std::nullopt);
  EXPECT_EQ(watchdog("0", ""), std::nullopt);
  EXPECT_EQ(watchdog("soon", ""), std::nullopt);
}

TEST_F(ServiceManagerTest, MayBeNobody) {
  ::unsetenv("NOTIFY_SOCKET");
  ::setenv("WATCHDOG_USEC", "20000000", 1);
  const Result<ServiceManager> nobody = ServiceManager::from_environment();
  ASSERT_TRUE(nobody);
  EXPECT_FALSE(nobody->is_there());
  EXPECT_EQ(nobody->watchdog(), std::nullopt);
  EXPECT_TRUE(nobody->ready());
  EXPECT_TRUE(nobody->status("alone"));
}

TEST_F(ServiceManagerTest, ThatCannotBeReachedIsAnError) {
  for (const std::string& name : {path_, std::string("vsock:2:1"), std::string("@"), "/" + std::string(200, 'x')}) {
    ::setenv("NOTIFY_SOCKET", name.c_str(), 1);
    const Result<ServiceManager> told = ServiceManager::from_environment();
    ASSERT_FALSE(told) << name;
    EXPECT_NE(told.error().message().find(name), std::string::npos);
  }
}

TEST_F(ServiceManagerTest, ThatDoesNotReadHoldsNobodyUp) {
  const Manager manager(path_);
  ::setenv("NOTIFY_SOCKET", path_.c_str(), 1);
  const Result<ServiceManager> told = ServiceManager::from_environment();
  ASSERT_TRUE(told);
  bool refused = false;
  for (int i = 0; i < 100'000 && !refused; ++i) refused = !told->alive();
  EXPECT_TRUE(refused);
  while (manager.heard() != "nothing") {
  }
  EXPECT_TRUE(told->alive());
}

}  // namespace
}  // namespace gyre
