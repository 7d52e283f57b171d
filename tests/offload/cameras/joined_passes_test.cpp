// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/joined_passes.h"

#include "tests/offload/cameras/bust.h"

#include <gtest/gtest.h>
#include <numbers>
#include <random>

namespace gyre {
namespace {

constexpr double pi = std::numbers::pi;
const Camera lens{.width = 720, .height = 1280, .fx = 1100, .fy = 1100, .cx = 360, .cy = 640};

Pose look_at(const Eigen::Vector3d& centre, const Eigen::Vector3d& target) {
  Eigen::Matrix3d rotation;
  rotation.row(2) = (target - centre).normalized();
  rotation.row(0) = rotation.row(2).cross(Eigen::RowVector3d::UnitY()).normalized();
  rotation.row(1) = rotation.row(2).cross(rotation.row(0));
  return {Eigen::Quaterniond(rotation).normalized(), -(rotation * centre)};
}

// Two walks around somebody that have no feature in common.
struct Walks {
  Scene scene;
  std::vector<Pose> cam_from_world;
  std::vector<ViewPair> pairs;
};

// A ring of views that sees the given points and, of them, whatever faces it.
void add_walk(Walks& walks, int pass, double radius, double height, const Eigen::Vector3d& target,
              const std::vector<SurfacePoint>& points) {
  constexpr int views = 20;
  std::mt19937_64 engine(static_cast<std::uint64_t>(pass) + 10);
  std::normal_distribution<double> noise(0.0, 0.3);
  const auto first = static_cast<int>(walks.scene.views.size());
  std::vector<std::vector<int>> seen(views);
  for (int v = 0; v < views; ++v) {
    const double angle = 2 * pi * v / views;
    const Eigen::Vector3d centre(radius * std::sin(angle), height + 0.05 * std::sin(3 * angle),
                                 radius * std::cos(angle));
    const Pose pose = look_at(centre, target);
    View view;
    view.pass = pass;
    view.order = v;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (points[i].normal.dot((centre - points[i].position).normalized()) < 0.25) continue;
      const auto pixel = lens.project(pose * points[i].position);
      if (!pixel || pixel->x() < 0 || pixel->y() < 0 || pixel->x() > 720 || pixel->y() > 1280) continue;
      view.keypoints.push_back(*pixel + Eigen::Vector2d(noise(engine), noise(engine)));
      seen[static_cast<std::size_t>(v)].push_back(static_cast<int>(i));
    }
    walks.scene.views.push_back(std::move(view));
    walks.cam_from_world.push_back(pose);
  }
  for (int v = 0; v < views; ++v)
    for (int step = 1; step <= 3; ++step) {
      const int other = (v + step) % views;
      ViewPair pair{first + std::min(v, other), first + std::max(v, other), {}};
      const auto& a = seen[static_cast<std::size_t>(std::min(v, other))];
      const auto& b = seen[static_cast<std::size_t>(std::max(v, other))];
      for (std::size_t i = 0; i < a.size(); ++i) {
        const auto found = std::lower_bound(b.begin(), b.end(), a[i]);
        if (found != b.end() && *found == a[i])
          pair.matches.push_back({static_cast<int>(i), static_cast<int>(found - b.begin())});
      }
      walks.pairs.push_back(std::move(pair));
    }
}

void add_room(std::vector<SurfacePoint>& points, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(engine() >> 11) * 0x1.0p-53;
  };
  for (int i = 0; i < 500; ++i) points.push_back({{uniform(-2.5, 2.5), 0, uniform(-2.5, 2.5)}, {0, 1, 0}});
  for (int wall = 0; wall < 4; ++wall)
    for (int i = 0; i < 150; ++i) {
      const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.5 * pi * wall, Eigen::Vector3d::UnitY()).toRotationMatrix();
      points.push_back(
          {turn * Eigen::Vector3d(uniform(-4, 4), uniform(0.1, 2.6), -4), turn * Eigen::Vector3d::UnitZ()});
    }
}

Walks make_walks() {
  Walks walks;
  walks.scene.cameras.push_back(Camera{.width = lens.width, .height = lens.height});
  std::vector<SurfacePoint> body = sample_bust(900, 0.02, 1);
  add_room(body, 2);
  add_walk(walks, 0, 2.3, 1.3, {0, 0.9, 0}, body);
  add_walk(walks, 1, 0.75, 1.6, {0, 1.53, 0.01}, sample_bust(1500, 1.25, 3));
  return walks;
}

double largest_error(const Walks& walks, const Scene& scene, int pass) {
  // Aligned by the body's cameras alone, so that the head's have to fit in.
  std::vector<Eigen::Vector3d> truth, found;
  for (std::size_t v = 0; v < scene.views.size(); ++v)
    if (scene.views[v].pass == 0) {
      truth.push_back(centre_of(walks.cam_from_world[v]));
      found.push_back(centre_of(scene.views[v].cam_from_world));
    }
  const auto truth_from_found = align_points(truth, found);
  if (!truth_from_found) return 1e9;
  double largest = 0;
  for (std::size_t v = 0; v < scene.views.size(); ++v)
    if (scene.views[v].pass == pass)
      largest = std::max(
          largest,
          (*truth_from_found * centre_of(scene.views[v].cam_from_world) - centre_of(walks.cam_from_world[v])).norm());
  return largest;
}

TEST(JoinedPasses, a_head_pass_without_common_features_finds_its_place) {
  const Walks walks = make_walks();
  Scene scene = walks.scene;
  ASSERT_TRUE(reconstruct(scene, walks.pairs, {}, [](double, std::string_view) {}));
  ASSERT_EQ(scene.registered_count(), 20);
  KnownLengths known;
  known.stature = 1.7;
  const auto joined = join_passes(scene, walks.pairs, known, {});
  ASSERT_EQ(joined.size(), 1U);
  EXPECT_EQ(joined.front().pass, 1);
  EXPECT_EQ(joined.front().views, 20);
  EXPECT_LT(joined.front().residual, 0.012);
  EXPECT_GT(joined.front().overlap, 0.8);
  EXPECT_EQ(scene.registered_count(), 40);
  EXPECT_LT(largest_error(walks, scene, 0), 0.01);
  EXPECT_LT(largest_error(walks, scene, 1), 0.03);
  double largest = 0.0;  // pixels
  for (const Track& track : scene.tracks)
    for (const Observation& o : track.observations)
      largest = std::max(largest, o.used ? reprojection_error(scene, o, track.point) : 0.0);
  EXPECT_LT(largest, 8.0);
}

TEST(JoinedPasses, nothing_happens_where_all_views_have_cameras) {
  const Walks walks = make_walks();
  Scene scene = walks.scene;
  for (View& view : scene.views) view.registered = true;
  EXPECT_TRUE(join_passes(scene, walks.pairs, {}, {}).empty());
}

}  // namespace
}  // namespace gyre
