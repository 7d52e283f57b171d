// SPDX-License-Identifier: Apache-2.0
#include "offload/landmarks/subject.h"

namespace gyre {

Result<Subject> make_subject(PointCloud cloud, std::vector<LandmarkView> views) {
  Subject subject;
  auto figure = measure_figure(cloud);
  if (!figure)
    return fail("the cloud has too few points to find a person in it", std::to_string(cloud.points.size()) + " points",
                "capture the subject from closer by, in better light");
  subject.cloud = std::move(cloud);
  subject.views = std::move(views);
  subject.figure = std::move(*figure);
  for (int side = 0; side < 2; ++side) {
    if (auto arm = trace_arm(subject.figure, side)) {
      subject.parts.arms[side] = std::move(*arm);
    } else {
      subject.parts.arm_reasons[side] = arm.error();
    }
  }
  subject.parts.feet = find_feet(subject.figure);
  subject.parts.faces = {find_face(subject.figure, subject.cloud, true),
                         find_face(subject.figure, subject.cloud, false)};
  subject.facing = decide_facing(subject.figure, subject.parts);
  return subject;
}

}  // namespace gyre
