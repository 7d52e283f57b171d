// SPDX-License-Identifier: Apache-2.0
#include "common/log/log.h"

#include "common/log/json_format.h"
#include "common/log/log_format.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sstream>

namespace gyre {
namespace {

using nlohmann::json;

constexpr const char* scan = "01ARZ3NDEKTSV4RRFFQ69G5FAV";
constexpr const char* other = "01BX5ZZKBKACTAV9WEVGEMMVRZ";

// Lines of stderr while `work` runs with that logging.
std::vector<std::string> lines_of(LogFormat format, const std::function<void()>& work) {
  const auto before = spdlog::default_logger();
  testing::internal::CaptureStderr();
  start_logging("gyre-test", "info", format);
  work();
  spdlog::default_logger()->flush();
  std::istringstream text(testing::internal::GetCapturedStderr());
  spdlog::set_default_logger(before);
  std::vector<std::string> lines;
  for (std::string line; std::getline(text, line);) lines.push_back(line);
  return lines;
}

TEST(Log, TextIsTimeLevelProgramMessage) {
  const auto lines = lines_of(LogFormat::text, [] {
    spdlog::info("scan {}: starts", scan);
    spdlog::debug("not said");
  });
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_TRUE(lines[0].ends_with(" info gyre-test: scan " + std::string(scan) + ": starts")) << lines[0];
}

TEST(Log, AJsonLineHasItsScanAsAField) {
  const auto lines = lines_of(LogFormat::json, [] {
    spdlog::warn("scan {}: \"quoted\"\nand \xff", scan);
    spdlog::info("serving");
  });
  ASSERT_EQ(lines.size(), 2U);
  const json first = json::parse(lines[0]);
  EXPECT_EQ(first.at("level"), "warning");
  EXPECT_EQ(first.at("program"), "gyre-test");
  EXPECT_EQ(first.at("scan"), scan);
  EXPECT_EQ(first.at("message"), "scan " + std::string(scan) + ": \"quoted\"\nand \xef\xbf\xbd");
  const std::string time = first.at("time");
  EXPECT_EQ(time.size(), 24U);
  EXPECT_EQ(time.back(), 'Z');
  EXPECT_FALSE(json::parse(lines[1]).contains("scan"));
}

TEST(Log, AProcessOfOneScanNamesItInEveryLine) {
  const auto lines = lines_of(LogFormat::json, [] {
    set_log_scan(scan);
    spdlog::info("depth of view 3");
    spdlog::info("scan {} is another", other);
  });
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_EQ(json::parse(lines[0]).at("scan"), scan);
  EXPECT_EQ(json::parse(lines[1]).at("scan"), other);
}

TEST(Log, TheLevelChangesInStepsAndIsSaid) {
  const auto lines = lines_of(LogFormat::text, [] {
    change_log_level(1);
    spdlog::debug("more");
    change_log_level(-10);
    spdlog::warn("less");
    EXPECT_EQ(spdlog::get_level(), spdlog::level::err);
    change_log_level(10);
    EXPECT_EQ(spdlog::get_level(), spdlog::level::trace);
  });
  ASSERT_EQ(lines.size(), 4U);
  EXPECT_NE(lines[0].find("from level debug on"), std::string::npos);
  EXPECT_NE(lines[1].find("more"), std::string::npos);
  EXPECT_NE(lines[2].find("from level error on"), std::string::npos);
  EXPECT_NE(lines[3].find("from level trace on"), std::string::npos);
}

TEST(Log, WhatAnotherProcessSaidBecomesAnObject) {
  const auto lines = lines_of(LogFormat::json, [] {
    hand_on_log_line("terminate called");
    hand_on_log_line(R"({"message": "mine"})");
  });
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_EQ(json::parse(lines[0]).at("message"), "terminate called");
  EXPECT_EQ(lines[1], R"({"message": "mine"})");
  EXPECT_EQ(lines_of(LogFormat::text, [] { hand_on_log_line("as it is"); }).at(0), "as it is");
}

TEST(Log, AScanIsFoundWhereMessagesNameIt) {
  EXPECT_EQ(scan_named_in("device rig asked for scan " + std::string(scan) + ", which"), scan);
  EXPECT_EQ(scan_named_in("cannot write: /srv/scans/" + std::string(scan) + "/scan.json"), scan);
  EXPECT_EQ(scan_named_in("scan of scan " + std::string(scan)), scan);
  EXPECT_EQ(scan_named_in(std::string("scan ") + scan + "X"), "");
  EXPECT_EQ(scan_named_in("the scan ends"), "");
}

}  // namespace
}  // namespace gyre
