// SPDX-License-Identifier: Apache-2.0
#include "offload/page/scan_view.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

using nlohmann::json;

std::vector<Stage> stages() {
  Stage one;
  one.name = "texture";
  one.options = {{"size", 4096}, {"blend", true}, {"kind", "png"}, {"network", ""}};
  one.external = {"network"};
  return {one};
}

TEST(StageOptions, AreTakenWhenTheyFit) {
  EXPECT_TRUE(check_page_options(json::object(), stages()));
  EXPECT_TRUE(check_page_options({{"texture", {{"size", 1024}, {"blend", false}, {"kind", "jpeg"}}}}, stages()));
  EXPECT_TRUE(check_page_options({{"texture", {{"size", 1024.0}}}}, stages()));
  EXPECT_TRUE(check_page_options({{"texture", {{"kind", nullptr}}}}, stages()));  // back to the default
}

TEST(StageOptions, ThatDoNotFitAreRefused) {
  for (const json& options :
       {json::array(), json{{"shape", json::object()}}, json{{"texture", 1}}, json{{"texture", {{"unknown", 1}}}},
        json{{"texture", {{"size", "big"}}}}, json{{"texture", {{"blend", 1}}}}}) {
    EXPECT_FALSE(check_page_options(options, stages())) << options;
  }
}

TEST(StageOptions, ThatNameFilesAreNotForThePage) {
  const Result<void> checked = check_page_options({{"texture", {{"network", "/etc/passwd"}}}}, stages());
  ASSERT_FALSE(checked);
  EXPECT_EQ(checked.error().kind, Error::Kind::usage);
}

}  // namespace
}  // namespace gyre
