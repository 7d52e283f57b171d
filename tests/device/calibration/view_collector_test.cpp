// SPDX-License-Identifier: Apache-2.0
#include "device/calibration/view_collector.h"

#include "tests/device/calibration/lens_picture.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

const Camera lens{.width = 800, .height = 600, .fx = 690, .fy = 690, .cx = 400, .cy = 300};

BoardView view_of(const Pose& pose) {
  BoardView view;
  for (const Eigen::Vector2d& pixel : true_corners(lens, pose)) view.push_back({static_cast<int>(view.size()), pixel});
  return view;
}

TEST(ViewCollector, TakesWhatIsStillAndNew) {
  ViewCollector collector(lens.width, lens.height);
  const std::vector<Pose> poses = round_of_views(lens, 2, 0.6);
  EXPECT_FALSE(collector.add({}));
  EXPECT_EQ(collector.advice(), "show the whole board");
  EXPECT_FALSE(collector.add(view_of(poses[0])));  // nothing is known of how it moves
  EXPECT_EQ(collector.advice(), "hold still");
  EXPECT_TRUE(collector.add(view_of(poses[0])));
  EXPECT_FALSE(collector.add(view_of(poses[0])));
  EXPECT_FALSE(collector.add(view_of(poses[1])));
  EXPECT_TRUE(collector.add(view_of(poses[1])));
  EXPECT_EQ(collector.views().size(), 2u);
  EXPECT_NE(collector.advice().find("picture's"), std::string::npos);
  EXPECT_GT(collector.fraction(), 0.0);
  EXPECT_FALSE(collector.is_enough());
}

TEST(ViewCollector, HasEnoughOnceThePictureIsCovered) {
  ViewCollector collector(lens.width, lens.height);
  double before = 0.0;
  for (const Pose& pose : round_of_views(lens, 64, 0.6)) {
    if (collector.is_enough()) break;
    collector.add(view_of(pose));
    collector.add(view_of(pose));
    EXPECT_GE(collector.fraction(), before);
    before = collector.fraction();
  }
  EXPECT_TRUE(collector.is_enough());
  EXPECT_EQ(collector.fraction(), 1.0);
  EXPECT_TRUE(calibrate_camera(collector.views(), lens.width, lens.height));
}

}  // namespace
}  // namespace gyre
