// SPDX-License-Identifier: Apache-2.0
#include "common/bundle/bundle.h"
#include "tests/fuzz/fuzz.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace gyre {
namespace {

TEST(BundleFuzz, MutatedJsonNeverCrashes) {
  Scan scan;
  scan.id = "01ARZ3NDEKTSV4RRFFQ69G5FAV";
  scan.created = "2026-01-31T08:15:00Z";
  scan.height_mm = 1660;
  scan.camera = Camera{.width = 720, .height = 1280, .fx = 1150, .fy = 1151, .cx = 360, .cy = 640, .k1 = -0.1};
  scan.passes.push_back({"body", 15.0, 300, 720, 1280});
  scan.passes.push_back({"head", 15.0, 150, 720, 1280});
  FrameRecord record;
  record.pass = "head";
  record.exposure_s = 0.01;
  record.decision = "keyframe";
  record.reason = "sharpest of its neighbourhood";
  fuzz({"", "body-000012.jpg", to_json(scan).dump(), to_json(record).dump(), R"({"camera":{"width":1e400}})", "[[[["},
       20'000);
}

}  // namespace
}  // namespace gyre
