// SPDX-License-Identifier: Apache-2.0
#include "offload/landmarks/face_landmarks.h"

#include "offload/landmarks/ears.h"
#include "offload/landmarks/eyes.h"
#include "offload/landmarks/jaw.h"
#include "offload/landmarks/mouth.h"
#include "offload/landmarks/placement.h"
#include "offload/landmarks/profile.h"

#include <algorithm>

namespace gyre {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

class FaceFinder {
 public:
  FaceFinder(const Subject& subject, const FaceFrame& frame, Detections& found)
      : subject_(subject),
        frame_(frame),
        found_(found),
        head_(head_points(subject.figure, subject.cloud, frame.world_from_face.linear().col(2))),
        sides_{head_points(subject.figure, subject.cloud, frame.world_from_face.linear().col(0)),
               head_points(subject.figure, subject.cloud, -frame.world_from_face.linear().col(0))},
        scale_(std::clamp(subject.figure.height / 1.7, 0.7, 1.1)) {}

  void find() {
    const FaceProfile profile = read_profile(frame_, head_, subject_.figure.height);
    find_midline(profile);
    find_front(profile);
    find_below(profile);
    find_jaw_line();
    find_both_ears();
  }

 private:
  void find_midline(const FaceProfile& profile) {
    for (const auto& [name, mark] : profile.marks)
      place_in_face(name, mark.place, Vector3d(0.002, mark.along, mark.across).cwiseAbs2().asDiagonal());
    found_.missing.insert(profile.missing.begin(), profile.missing.end());
  }

  // What the most frontal pictures show.
  void find_front(const FaceProfile& profile) {
    const FaceMap map = make_face_map(subject_, frame_, head_);
    const std::vector<const char*> eye_parts = {"EyeInner", "EyeOuter", "UpperLid", "LowerLid"};
    if (map.views.empty()) {
      for (const char* part : eye_parts) miss_pair(part, "no picture shows the face from the front");
      return miss_pair("MouthCorner", "no picture shows the face from the front");
    }
    if (const auto eyes = find_eyes(map, scale_)) {
      for (int side = 0; side < 2; ++side) {
        const EyeOpening& eye = eyes->eye[side];
        place(map, "EyeInner", side, eye.inner, eyes->deviation);
        place(map, "EyeOuter", side, eye.outer, eyes->deviation);
        place(map, "UpperLid", side, eye.upper_lid(), eyes->deviation);
        place(map, "LowerLid", side, eye.lower_lid(), eyes->deviation);
      }
    } else {
      for (const char* part : eye_parts) miss_pair(part, eyes.error());
    }
    const double line = profile.mouth != 0 ? profile.mouth : -0.032 * scale_;
    place_pair(map, "MouthCorner", find_mouth_corners(map, line, scale_));
  }

  // Nostrils are seen from below.
  void find_below(const FaceProfile& profile) {
    const auto height_of = [&](const char* name, double otherwise) {
      const auto mark = profile.marks.find(name);
      return mark == profile.marks.end() ? otherwise : mark->second.place.y();
    };
    const double tip = height_of("noseTip", 0), base = height_of("noseBase", tip - 0.014 * scale_);
    FaceViewRange range;
    range.low = -1.0;
    range.high = 0.1;
    range.best_pitch = -0.45;
    const FaceMap map = make_face_map(subject_, frame_, head_, range);
    if (map.views.empty()) return miss_pair("Nostril", "no picture shows the face from the front or from below");
    place_pair(map, "Nostril", find_nostrils(map, base, tip, scale_));
  }

  void find_jaw_line() {
    for (const char* part : {"Jaw", "JawAngle"}) miss_pair(part, "the cloud shows no edge of the jaw there");
    for (const JawMark& mark : find_jaw(frame_, sides_, subject_.figure.height)) {
      place_in_face(mark.name, mark.place, mark.covariance);
      found_.missing.erase(mark.name);
    }
  }

  void find_both_ears() {
    const auto ears = find_ears(frame_, sides_, subject_.figure.height);
    if (!ears) {
      for (const char* part : {"Ear", "EarLobe"}) miss_pair(part, "no pair of ears stands out; hair may cover them");
      return;
    }
    const Vector3d tip(0.004, 0.008, 0.006),
        lobe(0.006, 0.006, 0.006);  // standard deviations, metres: rims run upwards
    for (int side = 0; side < 2; ++side) {
      place_in_face(sided(side, "Ear"), (*ears)[side].tip, tip.cwiseAbs2().asDiagonal());
      place_in_face(sided(side, "EarLobe"), (*ears)[side].lobe, lobe.cwiseAbs2().asDiagonal());
    }
  }

  void place_in_face(const std::string& name, const Vector3d& in_face, const Matrix3d& covariance) {
    const Matrix3d axes = frame_.world_from_face.linear();
    found_.placed.push_back(
        {name, frame_.world_from_face * in_face, axes * covariance * axes.transpose(), "geometric", {}});
  }

  static std::string sided(int side, const char* part) { return (side == 0 ? "left" : "right") + std::string(part); }

  void miss_pair(const char* part, const std::string& reason) {
    for (int side = 0; side < 2; ++side) found_.missing[sided(side, part)] = reason;
  }

  void place_pair(const FaceMap& map, const char* part, const tl::expected<FeaturePair, std::string>& pair) {
    if (!pair) return miss_pair(part, pair.error());
    for (int side = 0; side < 2; ++side) place(map, part, side, pair->place[side], pair->deviation);
  }

  // At the depth the pictures agree on; else by the views' rays against the cloud. What the map shows at a wrong place
  // is wrong in all of them.
  void place(const FaceMap& map, const char* part, int side, const Vector2d& at, double deviation) {
    const std::string name = sided(side, part);
    if (const auto swept = sweep_depth(subject_, map, at)) {
      PlacedLandmark mark{name, *swept, deviation * deviation * Matrix3d::Identity(), "geometric", {}};
      for (const int view : map.views) mark.views.push_back(subject_.views[view].name);
      found_.placed.push_back(std::move(mark));
      return;
    }
    constexpr double matching = 0.0005;  // metres, of one view against the mean
    auto mark = place_landmark(subject_, detections_of(subject_, map, name, at, matching), "geometric");
    if (!mark) {
      found_.missing[name] = mark.error();
      return;
    }
    mark->covariance += deviation * deviation * Matrix3d::Identity();
    found_.placed.push_back(std::move(*mark));
  }

  const Subject& subject_;
  const FaceFrame& frame_;
  Detections& found_;
  std::vector<Vector3d> head_;                  // seen from the front
  std::array<std::vector<Vector3d>, 2> sides_;  // seen from the left and from the right
  double scale_;
};

}  // namespace

void find_face_landmarks(const Subject& subject, Detections& detections) {
  const auto miss_all = [&](const std::string& reason) {
    for (const char* name : {"noseTip", "sellion", "noseBase", "upperLip", "lowerLip", "chin"})
      detections.missing[name] = reason;
    for (const char* part : {"EyeInner", "EyeOuter", "UpperLid", "LowerLid", "MouthCorner", "Nostril", "Jaw",
                             "JawAngle", "Ear", "EarLobe"})
      for (const char* side : {"left", "right"}) detections.missing[std::string(side) + part] = reason;
  };
  if (!subject.facing.towards_across) return miss_all("which way the subject faces is not decided");
  const auto& frame = subject.parts.faces[*subject.facing.towards_across ? 0 : 1];
  if (!frame) return miss_all("the cloud shows no nose");
  FaceFinder(subject, *frame, detections).find();
}

}  // namespace gyre
