// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/scene.h"

#include "common/parallel/parallel.h"
#include "offload/cameras/verification.h"

namespace gyre {

int Track::used_count() const {
  return static_cast<int>(
      std::count_if(observations.begin(), observations.end(), [](const auto& o) { return o.used; }));
}

int Scene::registered_count() const {
  return static_cast<int>(std::count_if(views.begin(), views.end(), [](const View& v) { return v.registered; }));
}

void update_normalised(Scene& scene, int threads) {
  parallel_for(scene.views.size(), threads, [&](std::size_t i) {
    View& view = scene.views[i];
    const Camera& camera = scene.camera_of(view);
    view.normalised.resize(view.keypoints.size());
    for (std::size_t k = 0; k < view.keypoints.size(); ++k)
      view.normalised[k] = camera.normalised_from_pixel(view.keypoints[k]);
  });
}

double reprojection_error(const Scene& scene, const Observation& observation, const Eigen::Vector3d& point) {
  const View& view = scene.view_of(observation);
  const auto pixel = scene.camera_of(view).project(view.cam_from_world * point);
  return pixel ? (*pixel - scene.pixel_of(observation)).norm() : std::numeric_limits<double>::infinity();
}

double mean_reprojection_error(const Scene& scene) {
  double sum = 0.0;
  std::size_t count = 0;
  for (const Track& track : scene.tracks) {
    if (!track.triangulated) continue;
    for (const Observation& o : track.observations) {
      if (!o.used) continue;
      const double error = reprojection_error(scene, o, track.point);
      sum += error * error;
      ++count;
    }
  }
  return count == 0 ? 0.0 : std::sqrt(sum / static_cast<double>(count));
}

double epipolar_agreement(const Scene& scene, const ViewPair& pair, double max_error) {
  if (pair.matches.empty()) return 0.0;
  const View& a = scene.views[static_cast<std::size_t>(pair.a)];
  const View& b = scene.views[static_cast<std::size_t>(pair.b)];
  const Eigen::Matrix3d essential = essential_matrix(b.cam_from_world * a.cam_from_world.inverse());
  const double unit = 0.5 * (scene.camera_of(a).fx + scene.camera_of(b).fx);
  std::size_t agreeing = 0;
  for (const Match& m : pair.matches) {
    const double distance = sampson_distance(essential, a.normalised[static_cast<std::size_t>(m.a)],
                                             b.normalised[static_cast<std::size_t>(m.b)]);
    if (unit * distance < max_error) ++agreeing;
  }
  return static_cast<double>(agreeing) / static_cast<double>(pair.matches.size());
}

}  // namespace gyre
