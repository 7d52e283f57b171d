// SPDX-License-Identifier: Apache-2.0
// The face of the synthetic person: its eyes, lips and nostrils are painted at known places.
#include "offload/landmarks/face_landmarks.h"

#include "common/mesh/closest_point.h"
#include "offload/landmarks/subject.h"
#include "tests/offload/fit/random_person.h"
#include "tests/synthetic/capture.h"
#include "tests/temporary_folder.h"

#include <gtest/gtest.h>
#include <cstdlib>
#include <opencv2/imgcodecs.hpp>

namespace gyre {
namespace {

class Face : public testing::Test {
 protected:
  // One person for all tests: the pictures from the front and from below the chin, and a cloud of the whole.
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    synthetic::CaptureOptions options;
    options.sequence = synthetic::Sequence::orbit_head;
    options.width = 480;
    options.height = 640;
    options.frames = 90;
    options.cell = 0.005;
    options.seed = 3;
    capture_ = new synthetic::Capture(synthetic::make_capture(options));
    views_ = new std::vector<LandmarkView>;
    for (const synthetic::FrameTruth& frame : capture_->frames) {
      const Eigen::Vector3d c = centre_of(frame.cam_from_world);
      const double azimuth = std::atan2(c.x(), c.z());
      if (std::abs(azimuth) > 0.35 || frame.blurred || frame.segment == "crown") continue;
      LandmarkView view;
      view.name = "head-" + std::to_string(100000 + frame.index) + ".jpg";
      view.camera = capture_->camera;
      view.cam_from_world = frame.cam_from_world;
      view.picture = folder_->path() / view.name;
      cv::imwrite(view.picture.string(), synthetic::render_frame(*capture_, frame.index));
      views_->push_back(view);
    }
    cloud_ = new PointCloud(
        sample_visible(capture_->subject.mesh.vertices, capture_->subject.mesh.triangles, {400000, 0.001, 900, 5}));
  }
  static void TearDownTestSuite() {
    delete cloud_;
    delete views_;
    delete capture_;
    delete folder_;
  }

  // Point of the surface straight behind a place painted on the face.
  static Eigen::Vector3d painted(double x, double y) {
    const ClosestPoint surface(capture_->subject.mesh);
    return surface.first_hit({x, y, 1}, {0, 0, -1})->position;
  }

  static Detections find(const std::vector<LandmarkView>& views) {
    const auto subject = make_subject(*cloud_, views);
    EXPECT_TRUE(subject && subject->facing.towards_across);
    Detections found;
    if (subject) find_face_landmarks(*subject, found);
    return found;
  }

  static double error(const Detections& found, const std::string& name, const Eigen::Vector3d& truth) {
    for (const PlacedLandmark& mark : found.placed)
      if (mark.name == name) return (mark.position - truth).norm();
    ADD_FAILURE() << name << " was not placed: " << (found.missing.contains(name) ? found.missing.at(name) : "");
    return 0;
  }

  static TemporaryFolder* folder_;
  static synthetic::Capture* capture_;
  static std::vector<LandmarkView>* views_;
  static PointCloud* cloud_;
};

TemporaryFolder* Face::folder_ = nullptr;
synthetic::Capture* Face::capture_ = nullptr;
std::vector<LandmarkView>* Face::views_ = nullptr;
PointCloud* Face::cloud_ = nullptr;

TEST_F(Face, LandmarksLieWhereTheyArePainted) {
  ASSERT_GE(views_->size(), 4U);
  const Detections found = find(*views_);
  for (const double side : {1.0, -1.0}) {
    const std::string prefix = side > 0 ? "left" : "right";
    EXPECT_LT(error(found, prefix + "EyeInner", painted(side * 0.0155, 1.608)), 0.004);
    EXPECT_LT(error(found, prefix + "EyeOuter", painted(side * 0.0485, 1.608)), 0.004);
    EXPECT_LT(error(found, prefix + "MouthCorner", painted(side * 0.025, 1.5335)), 0.004);
  }
  EXPECT_LT(error(found, "noseTip", {0, 1.567, 0.140}), 0.004);
  for (const PlacedLandmark& mark : found.placed)
    EXPECT_LT(std::sqrt(mark.covariance.diagonal().maxCoeff()), 0.01) << mark.name;
}

TEST_F(Face, WithoutPicturesTheShapeAloneSpeaks) {
  const Detections found = find({});
  EXPECT_LT(error(found, "noseTip", {0, 1.567, 0.140}), 0.004);
  EXPECT_TRUE(found.missing.contains("leftEyeInner"));
  EXPECT_TRUE(found.missing.contains("rightMouthCorner"));
}

TEST_F(Face, AFaceThatIsNotThereIsMissing) {
  PointCloud without;
  for (std::size_t i = 0; i < cloud_->points.size(); ++i) {
    if (cloud_->points[i].y() > 1.48F && cloud_->points[i].z() > 0.03F) continue;
    without.points.push_back(cloud_->points[i]);
    without.normals.push_back(cloud_->normals[i]);
  }
  const auto subject = make_subject(without, *views_);
  ASSERT_TRUE(subject);
  Detections found;
  find_face_landmarks(*subject, found);
  EXPECT_TRUE(found.missing.contains("noseTip"));
  EXPECT_TRUE(found.missing.contains("leftEyeInner"));
}

// Faces of many people, whose landmarks are vertices: only the packed template has any.
TEST(FacesOfTheTemplate, AreFoundByTheirShape) {
  const char* file = std::getenv("GYRE_TEMPLATE");
  if (file == nullptr || *file == 0) GTEST_SKIP() << "no $GYRE_TEMPLATE";
  const auto body = read_template(file);
  ASSERT_TRUE(body.has_value());
  constexpr int people = 12;
  int ears = 0, jaws = 0;
  for (int seed = 0; seed < people; ++seed) {
    SCOPED_TRACE(seed);
    const RandomPerson person = random_person(*body, seed);
    const auto subject =
        make_subject(sample_visible(person.posed.vertices, body->mesh.triangles, {400000, 0.001, 900, 5}), {});
    ASSERT_TRUE(subject && subject->facing.towards_across);
    Detections found;
    find_face_landmarks(*subject, found);
    for (const PlacedLandmark& mark : found.placed) {
      const Eigen::Vector3d error = mark.position - person.posed.vertices[body->landmarks.at(mark.name)];
      if (mark.name == "noseTip") {
        EXPECT_LT(error.norm(), 0.008);
      } else if (mark.name == "chin") {
        EXPECT_LT(error.norm(), 0.012);
      } else if (mark.name == "leftEar" || mark.name == "rightEar") {
        EXPECT_LT(error.norm(), 0.025) << mark.name;
        ++ears;
      } else if (mark.name == "leftJaw" || mark.name == "rightJaw") {
        EXPECT_LT(error.norm(), 0.015) << mark.name;
        ++jaws;
      }
      // Nothing is surer of itself than it may be.
      EXPECT_LT(error.dot(mark.covariance.inverse() * error), 36.0) << mark.name;
    }
  }
  EXPECT_GT(ears, people);
  EXPECT_GT(jaws, people);
}

TEST(FacesOfTheTemplate, EarsUnderHairAreNotFound) {
  const char* file = std::getenv("GYRE_TEMPLATE");
  if (file == nullptr || *file == 0) GTEST_SKIP() << "no $GYRE_TEMPLATE";
  const auto body = read_template(file);
  ASSERT_TRUE(body.has_value());
  RandomPerson person = random_person(*body, 2);
  // A bob: everything of the head beside and behind the face lies under an ellipsoid around it.
  const Eigen::Vector3d nose = person.posed.vertices[body->landmarks.at("noseTip")];
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(person.yaw, Eigen::Vector3d::UnitY()).toRotationMatrix();
  const Eigen::Vector3d middle = nose + turn * Eigen::Vector3d(0, 0.04, -0.11), half(0.10, 0.15, 0.13);
  for (Eigen::Vector3d& v : person.posed.vertices) {
    const Eigen::Vector3d q = (turn.transpose() * (v - middle)).cwiseQuotient(half);
    if (q.norm() < 1 && q.z() < 0.35) v = middle + turn * half.cwiseProduct(q.normalized());
  }
  const auto subject =
      make_subject(sample_visible(person.posed.vertices, body->mesh.triangles, {400000, 0.001, 900, 5}), {});
  ASSERT_TRUE(subject && subject->facing.towards_across);
  Detections found;
  find_face_landmarks(*subject, found);
  EXPECT_TRUE(found.missing.contains("leftEar"));
  EXPECT_TRUE(found.missing.contains("rightEarLobe"));
  EXPECT_FALSE(found.missing.contains("noseTip"));
}

}  // namespace
}  // namespace gyre
