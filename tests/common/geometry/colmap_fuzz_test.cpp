// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/fuzz.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

TEST(ColmapFuzz, MutatedModelsNeverCrash) {
  using namespace std::string_literals;
  const std::string cameras =
      "# Camera list\n1 OPENCV 720 1280 1150 1150 360 640 -0.1 0.01 0 0\n2 PINHOLE 4 4 3 3 2 2\n";
  const std::string images =
      "# Image list\n1 1 0 0 0 0 0 2 1 body-000000.jpg\n10.5 20.5 7 30 40 -1\n2 0.5 0.5 0.5 0.5 1 2 3 1 b.jpg\n\n";
  const std::string points = "7 0.1 0.2 0.3 200 100 50 0.4 1 0 2 0\n";
  fuzz({"", cameras + "\0"s + images + "\0"s + points, cameras + "\0"s + images, "1 OPENCV 1e99 -3\0\0"s}, 5'000);
}

}  // namespace
}  // namespace gyre
