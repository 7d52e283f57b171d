// SPDX-License-Identifier: Apache-2.0
#include "common/config/config.h"

#include <gtest/gtest.h>
#include <unistd.h>
#include <CLI/CLI.hpp>
#include <fstream>

namespace gyre {
namespace {

class ConfigTest : public testing::Test {
 protected:
  void SetUp() override {
    file_ = testing::TempDir() + "config-" + std::to_string(::getpid()) + "-" +
            testing::UnitTest::GetInstance()->current_test_info()->name() + ".toml";
    add_config_option(app_, "");
    app_.add_option("--name", name_);
    CLI::App* run = app_.add_subcommand("run");
    run->add_option("--height-mm", height_);
    run->add_flag("--fast", fast_);
    run->configurable();
  }
  void TearDown() override { std::filesystem::remove(file_); }
  void parse(const std::string& toml, std::vector<std::string> arguments) {
    std::ofstream(file_) << toml;
    arguments.insert(arguments.begin(), {"--config", file_});
    std::reverse(arguments.begin(), arguments.end());
    app_.parse(arguments);
  }

  CLI::App app_;
  std::string name_, file_;
  double height_ = 0;
  bool fast_ = false;
};

TEST_F(ConfigTest, TablesAreVerbsAndKeysAreFlags) {
  parse("name = \"rig\"\n[run]\nheight-mm = 1660.5\nfast = true\n", {"run"});
  EXPECT_EQ(name_, "rig");
  EXPECT_EQ(height_, 1660.5);
  EXPECT_TRUE(fast_);
}

TEST_F(ConfigTest, AFlagWins) {
  parse("[run]\nheight-mm = 1660.5\n", {"run", "--height-mm", "1700"});
  EXPECT_EQ(height_, 1700);
}

TEST_F(ConfigTest, LettersBeyondAsciiNeedQuotes) {
  parse("# größer\nname = \"Zoë\"\n", {"run"});
  EXPECT_EQ(name_, "Zoë");
  EXPECT_THROW(parse("name = Zoë\n", {"run"}), CLI::Error);
  EXPECT_THROW(parse("größe = 1\n", {"run"}), CLI::Error);
}

TEST_F(ConfigTest, UnknownKeysAndBrokenFilesAreErrors) {
  EXPECT_THROW(parse("nmae = \"rig\"\n", {"run"}), CLI::Error);
  EXPECT_THROW(parse("name = [\n", {"run"}), CLI::Error);
}

}  // namespace
}  // namespace gyre
