// SPDX-License-Identifier: Apache-2.0
#include "offload/report/camera_errors.h"

namespace gyre {

Result<CameraErrors> camera_errors(const ColmapModel& model, const Truth& truth) {
  std::vector<Pose> estimated, known;
  for (const auto& [id, image] : model.images) {
    const auto name = parse_frame_name(image.name);
    if (!name) continue;
    const auto pass = truth.find(name->pass);
    if (pass == truth.end()) continue;
    const auto pose = pass->second.cam_from_world.find(name->index);
    if (pose == pass->second.cam_from_world.end()) continue;
    estimated.push_back(image.cam_from_world);
    known.push_back(pose->second);
  }
  std::vector<Eigen::Vector3d> estimated_centres, known_centres;
  for (const Pose& pose : estimated) estimated_centres.push_back(centre_of(pose));
  for (const Pose& pose : known) known_centres.push_back(centre_of(pose));
  const auto similarity = align_points(known_centres, estimated_centres);
  if (!similarity) return tl::unexpected(similarity.error());
  const auto rigid = align_points(known_centres, estimated_centres, false);
  if (!rigid) return tl::unexpected(rigid.error());
  CameraErrors errors;
  errors.truth_from_model = *similarity;
  for (std::size_t i = 0; i < known.size(); ++i) {
    errors.centre.push_back((*similarity * estimated_centres[i] - known_centres[i]).norm());
    errors.true_scale_centre.push_back((*rigid * estimated_centres[i] - known_centres[i]).norm());
    const Pose moved = cam_from_moved_world(estimated[i], *similarity);
    errors.rotation.push_back(angle_between(moved.rotation, known[i].rotation));
  }
  return errors;
}

}  // namespace gyre
