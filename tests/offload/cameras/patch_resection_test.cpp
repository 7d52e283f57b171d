// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/patch_resection.h"

#include "common/render/rasterise.h"
#include "offload/cameras/resection.h"
#include "tests/offload/cameras/column_scene.h"

#include <gtest/gtest.h>
#include <random>

namespace gyre {
namespace {

constexpr int views = 40;
constexpr double smear = 0.06;  // radians a picture is smeared over: 20 pixels of the wall

class PatchResection : public testing::Test {
 protected:
  PatchResection() : column_(make_column(views)), truth_(column_.scene) {
    options_.scales = {0.5, 0.5, 1.0};
    options_.patches.half_side = 9;
    options_.patches.reach = 8;
  }

  void lose(int v) {
    View& view = column_.scene.views[v];
    view.registered = false;
    view.cam_from_world = {};
    view.track_of.assign(view.keypoints.size(), -1);
    for (Track& track : column_.scene.tracks)
      std::erase_if(track.observations, [&](const Observation& o) { return o.view == v; });
  }
  PictureOfView pictures(double sweep_of_lost) {
    return [this, sweep_of_lost](int v) {
      Column as_it_was{truth_};
      return as_it_was.picture(v, lost_.contains(v) ? sweep_of_lost : 0.0);
    };
  }
  double centre_error(int v) const {
    return (centre_of(column_.scene.views[v].cam_from_world) - centre_of(truth_.views[v].cam_from_world)).norm();
  }
  double rotation_error(int v) const {
    return angle_between(column_.scene.views[v].cam_from_world.rotation, truth_.views[v].cam_from_world.rotation);
  }

  Column column_;
  Scene truth_;
  std::set<int> lost_;
  PatchResectionOptions options_;
};

TEST_F(PatchResection, AlignsPatchesOfASmearedPictureWithoutBias) {
  const int v = 7;
  std::vector<int> tracks(truth_.tracks.size());
  std::iota(tracks.begin(), tracks.end(), 0);
  const std::map<int, cv::Mat> references{{6, column_.picture(6)}, {8, column_.picture(8)}};
  // Looked for from a pose that is a little wrong.
  Pose guess = truth_.views[v].cam_from_world;
  guess.translation += Eigen::Vector3d(0.02, -0.01, 0.01);
  PatchPictures full_size = prepare_patch_pictures(column_.picture(v, smear), references, 1.0, options_.smoothing);
  const std::vector<AlignedPoint> aligned = align_patches(truth_, tracks, v, guess, {}, full_size, options_.patches);
  ASSERT_GT(aligned.size(), 60U);
  std::vector<double> x, y;
  for (const AlignedPoint& a : aligned) {
    const auto place = truth_.cameras[0].project(truth_.views[v].cam_from_world * truth_.tracks[a.track].point);
    x.push_back(a.pixel.x() - place->x());
    y.push_back(a.pixel.y() - place->y());
  }
  for (std::vector<double>* errors : {&x, &y}) {
    std::nth_element(errors->begin(), errors->begin() + static_cast<std::ptrdiff_t>(errors->size() / 2), errors->end());
    EXPECT_LT(std::abs((*errors)[errors->size() / 2]), 0.3);
  }
}

TEST(CameraMotion, IsThePoseInTheMiddleAndTheWholeWayFromEndToEnd) {
  const Pose pose = look_at({0, 1.5, 2}, {0, 1, 0});
  const CameraMotion motion{{0.1, 0.02, -0.03}, {0.01, -0.05, 0.02}};
  EXPECT_LT((centre_of(motion.pose_at(0, pose)) - centre_of(pose)).norm(), 1e-12);
  const Pose begin = motion.pose_at(-0.5, pose), end = motion.pose_at(0.5, pose);
  EXPECT_LT((centre_of(end) - centre_of(begin) - motion.shift).norm(), 1e-12);
  EXPECT_NEAR(angle_between(begin.rotation, end.rotation), motion.turn.norm(), 1e-9);
}

// A patch that is smeared as the picture is looks most like it.
TEST_F(PatchResection, AKnownSmearIsRecognised) {
  const int v = 7;
  std::vector<int> tracks(truth_.tracks.size());
  std::iota(tracks.begin(), tracks.end(), 0);
  const Pose& pose = truth_.views[v].cam_from_world;
  // Views stand 2 pi / views apart on the ring.
  const double share = smear / (4 * M_PI / views);
  const Pose &before = truth_.views[v - 1].cam_from_world, &after = truth_.views[v + 1].cam_from_world;
  const Eigen::AngleAxisd turn(after.rotation * before.rotation.conjugate());
  const CameraMotion motion{share * (centre_of(after) - centre_of(before)), share * turn.angle() * turn.axis()};
  const std::map<int, cv::Mat> references{{6, column_.picture(6)}, {8, column_.picture(8)}};
  PatchPictures full_size = prepare_patch_pictures(column_.picture(v, smear), references, 1.0, options_.smoothing);
  const auto correlation_with = [&](double factor) {
    const auto aligned = align_patches(truth_, tracks, v, pose, {factor * motion.shift, factor * motion.turn},
                                       full_size, options_.patches);
    EXPECT_GT(aligned.size(), 100U);
    double sum = 0.0;
    for (const AlignedPoint& a : aligned) sum += a.correlation;
    return sum / static_cast<double>(aligned.size());
  };
  EXPECT_GT(correlation_with(1.0), correlation_with(0.0));
  EXPECT_GT(correlation_with(1.0), correlation_with(0.5));
  EXPECT_GT(correlation_with(1.0), correlation_with(2.0));
}

TEST(RefinePose, FindsThePoseDespiteOutliers) {
  const Pose truth = look_at({0.3, 1.6, 2.2}, {0, 1, 0});
  std::mt19937 random(3);
  std::uniform_real_distribution<double> in(-0.5, 0.5);
  std::vector<Eigen::Vector2d> seen;
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 100; ++i) {
    points.emplace_back(in(random), 1 + in(random), in(random));
    seen.push_back((truth * points.back()).hnormalized());
    if (i % 5 == 0) seen.back() += Eigen::Vector2d(in(random), in(random));
  }
  Pose guess = truth;
  guess.translation += Eigen::Vector3d(0.02, -0.01, 0.03);
  const Pose found = refine_pose(guess, seen, points, 1e-3);
  EXPECT_LT((centre_of(found) - centre_of(truth)).norm(), 1e-3);
  EXPECT_LT(angle_between(found.rotation, truth.rotation), 1e-3);
}

TEST_F(PatchResection, PlacesThreeSmearedViewsInARow) {
  lost_ = {20, 21, 22};
  for (const int v : lost_) lose(v);
  std::vector<int> placed = place_between_neighbours(column_.scene, pictures(smear), options_);
  std::sort(placed.begin(), placed.end());
  EXPECT_EQ(placed, (std::vector<int>{20, 21, 22}));
  for (const int v : lost_) {
    EXPECT_TRUE(column_.scene.views[v].registered);
    EXPECT_LT(centre_error(v), 0.02) << v;
    EXPECT_LT(rotation_error(v), 0.01) << v;
  }
}

TEST_F(PatchResection, LeavesOutAPictureOfSomethingElse) {
  lost_ = {10};
  lose(10);
  const auto true_pictures = pictures(0.0);
  const auto swapped = [&](int v) { return true_pictures(v == 10 ? 30 : v); };
  EXPECT_TRUE(place_between_neighbours(column_.scene, swapped, options_).empty());
  EXPECT_FALSE(column_.scene.views[10].registered);
}

TEST_F(PatchResection, LeavesOutAPictureThatCannotBeRead) {
  lost_ = {10};
  lose(10);
  const auto true_pictures = pictures(0.0);
  const auto missing = [&](int v) { return v == 10 ? cv::Mat() : true_pictures(v); };
  EXPECT_TRUE(place_between_neighbours(column_.scene, missing, options_).empty());
}

TEST_F(PatchResection, NeedsNeighboursOnBothSides) {
  lost_ = {0};
  lose(0);
  EXPECT_TRUE(place_between_neighbours(column_.scene, pictures(0.0), options_).empty());
}

}  // namespace
}  // namespace gyre
