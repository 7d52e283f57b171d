// SPDX-License-Identifier: Apache-2.0
#include "device/camera/fault_script.h"

#include "tests/fuzz/fuzz.h"

#include <gtest/gtest.h>
#include <string>

namespace gyre {
namespace {

using Kind = Fault::Kind;
using Until = Fault::Until;

const std::string every_kind = R"({"faults": [
  {"before_frame": 0, "kind": "late", "seconds": 0.4},
  {"before_frame": 40, "kind": "missing", "frames": 3},
  {"before_frame": 50, "kind": "torn"},
  {"before_frame": 60, "kind": "silence", "until": "restart"},
  {"before_frame": 70, "kind": "broken", "until": "reopen"},
  {"before_frame": 80, "kind": "gone", "seconds": 5},
  {"before_frame": 90, "kind": "gone", "until": "never"}]})";

TEST(FaultScript, ReadsEveryKind) {
  const Result<std::vector<Fault>> faults = parse_fault_script(every_kind);
  ASSERT_TRUE(faults) << faults.error().message();
  const std::vector<Fault> expected = {
      {Kind::late, 0, 1, 0.4, Until::time},      {Kind::missing, 40, 3, 0.0, Until::time},
      {Kind::torn, 50, 1, 0.0, Until::time},     {Kind::silence, 60, 1, 0.0, Until::restart},
      {Kind::broken, 70, 1, 0.0, Until::reopen}, {Kind::gone, 80, 1, 5.0, Until::time},
      {Kind::gone, 90, 1, 0.0, Until::never}};
  EXPECT_EQ(*faults, expected);
  EXPECT_TRUE(parse_fault_script(R"({"faults": []})")->empty());
}

TEST(FaultScript, SaysWhatIsWrong) {
  const auto error = [](const std::string& entries) {
    const auto faults = parse_fault_script("{\"faults\": [" + entries + "]}");
    if (faults) return std::string("accepted");
    EXPECT_EQ(faults.error().exit_code(), 2);
    return faults.error().message();
  };
  const std::string good = R"({"before_frame": 1, "kind": "torn"})";
  EXPECT_EQ(error(good), "accepted");
  EXPECT_NE(error(good + "," + good).find("fault 2"), std::string::npos);
  EXPECT_NE(error(R"({"before_frame": 1, "kind": "tired"})").find("silence"), std::string::npos);
  EXPECT_NE(error(R"({"before_frame": -1, "kind": "torn"})").find("before_frame"), std::string::npos);
  EXPECT_NE(error(R"({"before_frame": 1e9, "kind": "torn"})").find("before_frame"), std::string::npos);
  EXPECT_NE(error(R"({"before_frame": 1, "kind": "torn", "frames": 0})").find("frames"), std::string::npos);
  EXPECT_NE(error(R"({"before_frame": 1, "kind": "late"})").find("seconds"), std::string::npos);
  EXPECT_NE(error(R"({"before_frame": 1, "kind": "late", "until": "restart"})").find("until"), std::string::npos);
  EXPECT_NE(error(R"({"before_frame": 1, "kind": "gone", "until": "restart"})").find("gone"), std::string::npos);
  EXPECT_NE(error(R"({"before_frame": 1, "kind": "torn", "seconds": 1})").find("nothing"), std::string::npos);
  EXPECT_NE(error("7").find("object"), std::string::npos);
  EXPECT_FALSE(parse_fault_script("["));
  EXPECT_FALSE(parse_fault_script("[]"));
  EXPECT_FALSE(parse_fault_script(R"({"faults": 1})"));
}

TEST(FaultScript, NamesTheFile) {
  const auto missing = read_fault_script("/nowhere/faults.json");
  ASSERT_FALSE(missing);
  EXPECT_NE(missing.error().message().find("/nowhere/faults.json"), std::string::npos);
}

TEST(CameraFuzz, MutatedNamesAndScriptsNeverCrash) {
  fuzz({every_kind, "", "{}", "replay:/a/b.mp4?faults=x.json", "v4l2:/dev/video0?size=640x480&format=NV12&buffers=8",
        "libcamera:", R"({"faults":[{"before_frame":1e400,"kind":"gone","until":[]}]})"},
       20'000);
}

}  // namespace
}  // namespace gyre
