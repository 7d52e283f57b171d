// SPDX-License-Identifier: Apache-2.0
#include "device/analysis/subject_watch.h"

#include "tests/device/analysis/staged_views.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

using test::StagedViews;

constexpr double frame = 1.0 / 30.0;

// A camera that goes slowly around somebody who has a place in the map.
class SubjectWatchTest : public testing::Test {
 protected:
  SubjectWatchTest() { distance_.measure_depth(std::vector<double>(20, StagedViews::depth), StagedViews::depth); }

  View view(double aside) const { return stage_.see(StagedViews::around(0.1 + 0.1 * time_), time_, aside); }
  double watch(double aside) {
    time_ += frame;
    return watch_.add(view(aside), map_, stage_.camera, distance_).half;
  }
  double after(int frames, double aside) {
    double most = 0.0;
    for (int i = 0; i < frames; ++i) most = std::max(most, watch(aside));
    return most;
  }

  StagedViews stage_;
  ViewMap map_ = stage_.map();
  SubjectDistance distance_;
  SubjectWatch watch_;
  double time_ = 0.0;
};

TEST_F(SubjectWatchTest, WhoStandsDoesNotMove) {
  EXPECT_LT(after(40, 0.0), 1e-6);
  EXPECT_FALSE(watch_.is_moving(time_));
  EXPECT_FALSE(watch_.moved_just_now(time_));
}

TEST_F(SubjectWatchTest, AStepAsideIsMovementUntilItIsOver) {
  after(20, 0.0);
  constexpr double aside = 0.06;
  const double pixels = stage_.camera.fx * aside / StagedViews::depth;
  const double moved = watch(aside);
  EXPECT_LT(moved, 1.05 * pixels);
  EXPECT_GT(moved, 0.5 * pixels) << "a further motion of the camera explains no more than a part";
  EXPECT_TRUE(watch_.is_moving(time_));
  after(20, aside);
  EXPECT_FALSE(watch_.is_moving(time_)) << "stands at another place";
  EXPECT_TRUE(watch_.moved_just_now(time_));
  after(20, aside);
  EXPECT_FALSE(watch_.moved_just_now(time_));
}

TEST_F(SubjectWatchTest, PointsWhosePlacesAreGoneTellAStep) {
  after(20, 0.0);
  map_.add(view(0.06));
  watch_.leave_subject(map_, stage_.camera, distance_);
  EXPECT_GT(watch(0.06), 2.0);
}

TEST_F(SubjectWatchTest, LeavingTakesThePlacesOfTheSubjectOnly) {
  map_.add(view(0.0));
  watch_.leave_subject(map_, stage_.camera, distance_);
  for (const auto& [id, place] : map_.points()) {
    const bool is_room = id >= StagedViews::subject;
    EXPECT_TRUE(is_room || !is_in_the_middle(stage_.camera, map_.views().back().seen.at(id)));
  }
  EXPECT_GE(map_.points().size(), StagedViews::room);
  EXPECT_LT(map_.points().size(), stage_.places.size());
}

TEST_F(SubjectWatchTest, WithoutARoomThePlacesStay) {
  for (int i = 0; i < StagedViews::room; ++i) stage_.places.erase(StagedViews::subject + i);
  map_ = stage_.map();
  map_.add(view(0.0));
  watch_.leave_subject(map_, stage_.camera, distance_);
  EXPECT_EQ(map_.points().size(), StagedViews::subject);
}

}  // namespace
}  // namespace gyre
