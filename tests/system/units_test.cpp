// SPDX-License-Identifier: Apache-2.0
// What is installed around the programs, as systemd and udev themselves read it; skipped where they are not.
#include "common/bundle/atomic_file.h"
#include "tests/system/programs.h"
#include "tests/temporary_folder.h"

#include <gtest/gtest.h>
#include <regex>

namespace gyre {
namespace {

namespace fs = std::filesystem;

const fs::path source = GYRE_SOURCE;

std::string tool(const char* name) {
  for (const char* folder : {"/usr/bin", "/bin"}) {
    if (fs::exists(fs::path(folder) / name)) return (fs::path(folder) / name).string();
  }
  return {};
}

class Unit : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    if (analyze_.empty()) GTEST_SKIP() << "no systemd-analyze here";
  }
  const std::string analyze_ = tool("systemd-analyze");
  const std::string name_ = std::string(GetParam()) + ".service";
  const std::string unit_ = (source / "systemd" / name_).string();
};

TEST_P(Unit, ReadsWithoutAWarning) {
  // The program is found by its name when it is installed; here it is where the build has put it.
  std::string text = read_file(unit_).value();
  const std::string start = "ExecStart=";
  text.replace(text.find(start), start.size(), start + GYRE_BIN + "/");
  const TemporaryFolder folder;
  const std::string file = (folder.path() / name_).string();
  ASSERT_TRUE(write_file(file, text));
  const Finished checked = run_program(analyze_, {"verify", file});
  EXPECT_EQ(checked.code, 0);
  EXPECT_EQ(checked.err.find(GetParam()), std::string::npos) << checked.err;
}

TEST_P(Unit, IsHardened) {
  const Finished rated = run_program(analyze_, {"security", "--offline=true", "--no-pager", unit_});
  std::smatch level;
  ASSERT_TRUE(std::regex_search(rated.out, level, std::regex("exposure level for .*: ([0-9.]+)"))) << rated.err;
  EXPECT_LE(std::stod(level[1]), 2.0);
}

INSTANTIATE_TEST_SUITE_P(Programs, Unit, testing::Values("gyre-device", "gyre-offload"));

TEST(Udev, RulesAreRead) {
  const std::string udevadm = tool("udevadm");
  if (udevadm.empty() || run_program(udevadm, {"verify", "--help"}).code != 0) GTEST_SKIP() << "no udevadm verify here";
  const Finished checked =
      run_program(udevadm, {"verify", "--resolve-names=never", (source / "udev/70-gyre-device.rules").string()});
  EXPECT_EQ(checked.code, 0) << checked.out << checked.err;
}

TEST(Sysusers, AreRead) {
  const std::string sysusers = tool("systemd-sysusers");
  if (sysusers.empty()) GTEST_SKIP() << "no systemd-sysusers here";
  for (const char* program : {"gyre-device", "gyre-offload"}) {
    const std::string file = (source / "systemd" / (std::string(program) + ".sysusers")).string();
    const Finished checked = run_program(sysusers, {"--dry-run", file});
    EXPECT_EQ(checked.code, 0) << checked.err;
    EXPECT_EQ(checked.err.find("ignoring"), std::string::npos) << checked.err;
  }
}

}  // namespace
}  // namespace gyre
