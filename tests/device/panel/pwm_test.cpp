// SPDX-License-Identifier: Apache-2.0
#include "device/panel/pwm.h"

#include "common/bundle/atomic_file.h"
#include "tests/temporary_folder.h"

#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <unistd.h>
#include <fstream>
#include <thread>

namespace gyre {
namespace {

namespace fs = std::filesystem;

// A folder that looks like /sys/class/pwm with one chip of two exported channels.
class PwmTest : public testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(folder_.path() / "devices" / "fe20c000.pwm");
    const fs::path chip = root() / "pwmchip3";
    fs::create_directories(chip / "pwm1");
    fs::create_directory_symlink(folder_.path() / "devices" / "fe20c000.pwm", chip / "device");
  }
  fs::path root() const { return folder_.path() / "class"; }
  std::string value(const std::string& name) const {
    return read_file(root() / "pwmchip3" / "pwm1" / name).value_or("");
  }

  TemporaryFolder folder_;
};

TEST_F(PwmTest, AToneIsAPeriodAndHalfOfIt) {
  Result<std::unique_ptr<Pwm>> pwm = Pwm::open({"fe20c000.pwm", 1}, root());
  ASSERT_TRUE(pwm) << pwm.error().message();
  ASSERT_TRUE((*pwm)->set(1000.0, 0.5));
  EXPECT_EQ(value("period"), "1000000");
  EXPECT_EQ(value("duty_cycle"), "500000");
  EXPECT_EQ(value("enable"), "1");
  ASSERT_TRUE((*pwm)->set(2000.0, 0.25));
  EXPECT_EQ(value("period"), "500000");
  EXPECT_EQ(value("duty_cycle"), "125000");
  ASSERT_TRUE((*pwm)->set(0.0, 0.0));
  EXPECT_EQ(value("enable"), "0");
  ASSERT_TRUE((*pwm)->set(2000.0, 1.0));
  EXPECT_EQ(value("enable"), "1");
  pwm->reset();
  EXPECT_EQ(value("enable"), "0");
}

TEST_F(PwmTest, WhatIsNotThereIsNamed) {
  const auto other = Pwm::open({"fe20d000.pwm", 1}, root());
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().what, "no such PWM device");
  std::ofstream(root() / "pwmchip3" / "export") << "";
  const auto channel = Pwm::open({"fe20c000.pwm", 7}, root(), std::chrono::milliseconds(0));
  ASSERT_FALSE(channel);
  EXPECT_EQ(channel.error().where, "fe20c000.pwm:7");
  EXPECT_FALSE(Pwm::open({"fe20c000.pwm", 1}, folder_.path() / "nowhere"));
}

// As udev does it: the channel is there at once, and ours a little later.
TEST_F(PwmTest, AChannelThatBelongsToRootAtFirstIsWaitedFor) {
  fs::permissions(folder_.path(), fs::perms(0755));
  const fs::path chip = root() / "pwmchip3", channel = chip / "pwm7";
  std::ofstream(chip / "export") << std::flush;
  fs::permissions(chip / "export", fs::perms(0666));
  std::thread kernel_and_udev([&] {
    while (read_file(chip / "export").value_or("") != "7") std::this_thread::yield();
    fs::create_directory(channel);
    for (const char* const file : {"period", "duty_cycle", "enable"}) {
      std::ofstream(channel / file) << std::flush;
      fs::permissions(channel / file, fs::perms(0444));
    }
    for (const char* const file : {"period", "duty_cycle", "enable"}) {
      std::this_thread::yield();
      fs::permissions(channel / file, fs::perms(0666));
    }
  });
  // Root may write anyway, so this thread alone is somebody else.
  constexpr int nobody = 65534;
  const bool is_root = ::geteuid() == 0;
  if (is_root) ::syscall(SYS_setresuid, -1, nobody, -1);
  const auto pwm = Pwm::open({"fe20c000.pwm", 7}, root(), std::chrono::seconds(60));
  const Result<void> set = pwm ? (*pwm)->set(1000.0, 0.5) : Result<void>(tl::unexpected(pwm.error()));
  if (is_root) ::syscall(SYS_setresuid, -1, 0, -1);
  kernel_and_udev.join();
  ASSERT_TRUE(set) << set.error().message();
  EXPECT_EQ(read_file(channel / "enable").value_or(""), "1");
}

TEST_F(PwmTest, NamesAreDeviceAndChannel) {
  EXPECT_EQ(parse_pwm_name("fe20c000.pwm:1")->device, "fe20c000.pwm");
  EXPECT_EQ(parse_pwm_name("fe20c000.pwm:1")->channel, 1);
  for (const char* const bad : {"", ":", "1", "pwm:", ":1", "pwm:x", "pwm:-1", "../pwm:1", "pwm:1 "})
    EXPECT_FALSE(parse_pwm_name(bad)) << bad;
}

}  // namespace
}  // namespace gyre
