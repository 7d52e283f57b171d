// SPDX-License-Identifier: Apache-2.0
#include "tests/offload/cameras/orbit_scene.h"

#include "offload/cameras/tracks.h"

#include <random>

namespace gyre {

namespace {

constexpr double pi = 3.14159265358979323846;
constexpr double subject_height = 1.7;
constexpr double room_half_width = 4.0;
constexpr double room_height = 2.6;

// Numbers that are the same on every standard library, unlike those of std::uniform_real_distribution.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1.0p-53;
  }
  double normal(double sigma) {
    return sigma * std::sqrt(-2 * std::log(uniform(1e-12, 1))) * std::cos(2 * pi * uniform(0, 1));
  }
  int below(int count) { return static_cast<int>(uniform(0, count)); }

 private:
  std::mt19937_64 engine_;
};

struct PointWithNormal {
  Eigen::Vector3d position;
  Eigen::Vector3d normal;
};

std::vector<PointWithNormal> make_points(const OrbitOptions& options, Random& random) {
  std::vector<PointWithNormal> points;
  for (int i = 0; i < options.body_points; ++i) {
    const double angle = random.uniform(0, 2 * pi);
    const Eigen::Vector3d outward(std::sin(angle), 0, std::cos(angle));
    // The first few sit on the crown, so that the subject has a well-defined top.
    const double y = i < 30 ? subject_height : random.uniform(0.02, subject_height);
    const double radius = i < 30 ? random.uniform(0, 0.08) : 0.16 + 0.04 * std::sin(9 * y);
    points.push_back({radius * outward + y * Eigen::Vector3d::UnitY(), outward});
  }
  for (int i = 0; i < options.room_points; ++i) {
    const int wall = random.below(4);
    const double along = random.uniform(-room_half_width, room_half_width);
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.5 * pi * wall, Eigen::Vector3d::UnitY()));
    points.push_back({turn * Eigen::Vector3d(along, random.uniform(0.1, room_height), -room_half_width),
                      turn * Eigen::Vector3d::UnitZ()});
  }
  for (int i = 0; i < options.floor_points; ++i)
    points.push_back({{random.uniform(-2.5, 2.5), 0, random.uniform(-2.5, 2.5)}, Eigen::Vector3d::UnitY()});
  return points;
}

Pose look_at(const Eigen::Vector3d& centre, const Eigen::Vector3d& target) {
  const Eigen::Vector3d z = (target - centre).normalized();
  const Eigen::Vector3d x = z.cross(Eigen::Vector3d::UnitY()).normalized();
  Eigen::Matrix3d rotation;
  rotation.row(0) = x;
  rotation.row(1) = z.cross(x);
  rotation.row(2) = z;
  return {Eigen::Quaterniond(rotation).normalized(), -(rotation * centre)};
}

// A fixed camera that stands askew: it looks past the subject, down, and is not level.
Pose skew_camera(double radius) {
  const Pose level = look_at({0, 1.5, radius}, {0.25, 0.9, 0});
  return Pose{Eigen::Quaterniond(Eigen::AngleAxisd(0.05, Eigen::Vector3d::UnitZ())), Eigen::Vector3d::Zero()} * level;
}

ViewPair match(const Orbit& orbit, int a, int b, const OrbitOptions& options, Random& random) {
  ViewPair pair{a, b, {}};
  const auto& points_a = orbit.point_of[static_cast<std::size_t>(a)];
  const auto& points_b = orbit.point_of[static_cast<std::size_t>(b)];
  for (std::size_t i = 0; i < points_a.size(); ++i) {
    const auto found = std::lower_bound(points_b.begin(), points_b.end(), points_a[i]);
    if (found == points_b.end() || *found != points_a[i]) continue;
    int j = static_cast<int>(found - points_b.begin());
    if (random.uniform(0, 1) < options.outlier_share) j = random.below(static_cast<int>(points_b.size()));
    pair.matches.push_back({static_cast<int>(i), j});
  }
  return pair;
}

}  // namespace

Orbit make_orbit(const OrbitOptions& options) {
  Random random(options.seed);
  Orbit orbit;
  orbit.camera = options.camera;
  const std::vector<PointWithNormal> points = make_points(options, random);
  for (const PointWithNormal& p : points) orbit.points.push_back(p.position);
  orbit.scene.cameras.push_back(Camera{.width = options.camera.width, .height = options.camera.height});
  for (int v = 0; v < options.views; ++v) {
    const double angle = options.arc * v / options.views;
    const double radius = options.radius + random.normal(0.05);
    const Eigen::Vector3d centre(radius * std::sin(angle), 1.3 + random.normal(0.05), radius * std::cos(angle));
    const Eigen::Vector3d target(random.normal(0.03), 0.9 + random.normal(0.03), random.normal(0.03));
    const Pose cam_from_room = options.motion == Motion::turn ? skew_camera(options.radius) : look_at(centre, target);
    const Pose room_from_body{
        Eigen::Quaterniond(Eigen::AngleAxisd(options.motion == Motion::turn ? angle : 0.0, Eigen::Vector3d::UnitY())),
        Eigen::Vector3d::Zero()};
    orbit.cam_from_world.push_back(cam_from_room * room_from_body);
    View view;
    view.order = v;
    view.motion = options.motion;
    std::vector<int> seen;
    for (std::size_t p = 0; p < points.size(); ++p) {
      const bool of_body = p < static_cast<std::size_t>(options.body_points);
      const Pose cam_from_point = of_body ? orbit.cam_from_world.back() : cam_from_room;
      // A surface seen at a grazing angle has other descriptors from view to view.
      const Eigen::Vector3d towards_camera = (centre_of(cam_from_point) - points[p].position).normalized();
      if (points[p].normal.dot(towards_camera) < 0.2 && p >= 30) continue;
      const Eigen::Vector3d sway =
          !options.sway.empty() && of_body ? options.sway[static_cast<std::size_t>(v)] : Eigen::Vector3d::Zero();
      const auto pixel = orbit.camera.project(cam_from_point * (points[p].position + sway));
      if (!pixel || pixel->x() < 0 || pixel->y() < 0 || pixel->x() > 720 || pixel->y() > 1280) continue;
      view.keypoints.push_back(*pixel +
                               Eigen::Vector2d(random.normal(options.pixel_noise), random.normal(options.pixel_noise)));
      seen.push_back(static_cast<int>(p));
    }
    orbit.scene.views.push_back(std::move(view));
    orbit.point_of.push_back(std::move(seen));
  }
  const bool closed = options.arc > 1.99 * pi;
  for (int v = 0; v < options.views; ++v) {
    for (int step = 1; step <= 3; ++step) {
      const int other = v + step;
      if (other < options.views) orbit.pairs.push_back(match(orbit, v, other, options, random));
      if (other >= options.views && closed)
        orbit.pairs.push_back(match(orbit, other - options.views, v, options, random));
    }
  }
  return orbit;
}

std::vector<Features> features_of(const Orbit& orbit) {
  std::vector<Features> all;
  Random random(77);
  for (std::size_t v = 0; v < orbit.scene.views.size(); ++v) {
    Features features;
    features.width = orbit.camera.width;
    features.height = orbit.camera.height;
    features.keypoints = orbit.scene.views[v].keypoints;
    for (std::size_t k = 0; k < features.keypoints.size(); ++k) {
      Random of_point(1000 + static_cast<std::uint64_t>(orbit.point_of[v][k]));
      std::array<float, 128> histogram{};
      for (float& bin : histogram)
        bin = static_cast<float>(std::pow(of_point.normal(1.0), 4) * random.uniform(0.7, 1.3));
      features.descriptors.push_back(root_sift(histogram.data()));
      features.keypoint_of.push_back(static_cast<int>(k));
      features.sizes.push_back(1.0F);
      features.colours.push_back({128, 128, 128});
    }
    all.push_back(std::move(features));
  }
  return all;
}

Scene true_scene(const Orbit& orbit) {
  Scene scene = orbit.scene;
  scene.cameras[0] = orbit.camera;
  build_tracks(scene, orbit.pairs);
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    scene.views[v].registered = true;
    scene.views[v].cam_from_world = orbit.cam_from_world[v];
  }
  update_normalised(scene, 1);
  for (Track& track : scene.tracks) {
    const Observation& first = track.observations.front();
    const int point = orbit.point_of[static_cast<std::size_t>(first.view)][static_cast<std::size_t>(first.keypoint)];
    track.point = orbit.points[static_cast<std::size_t>(point)];
    track.triangulated = track.observations.size() >= 2;
    for (Observation& o : track.observations)
      o.used = orbit.point_of[static_cast<std::size_t>(o.view)][static_cast<std::size_t>(o.keypoint)] == point;
  }
  return scene;
}

double largest_centre_error(const Orbit& orbit, const Scene& scene) {
  std::vector<Eigen::Vector3d> truth, found;
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    if (!scene.views[v].registered) continue;
    truth.push_back(centre_of(orbit.cam_from_world[v]));
    found.push_back(centre_of(scene.views[v].cam_from_world));
  }
  const Result<Similarity> truth_from_found = align_points(truth, found);
  if (!truth_from_found) return std::numeric_limits<double>::infinity();
  double largest = 0.0;
  for (std::size_t i = 0; i < truth.size(); ++i)
    largest = std::max(largest, (*truth_from_found * found[i] - truth[i]).norm());
  return largest;
}

}  // namespace gyre
