// SPDX-License-Identifier: Apache-2.0
#include "tests/synthetic/capture.h"

#include "common/mesh/closest_point.h"
#include "tests/synthetic/write_capture.h"
#include "tests/temporary_folder.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

namespace gyre::synthetic {
namespace {

CaptureOptions small_options() {
  CaptureOptions options;
  options.width = 144;
  options.height = 256;
  options.frames = 60;
  options.cell = 0.02;
  return options;
}

const Capture& shared_capture() {
  static const Capture capture = [] {
    CaptureOptions options = small_options();
    options.noise = 0;
    options.sway_deg = 1.5;
    return make_capture(options);
  }();
  return capture;
}

double sharpness(const cv::Mat& image) {
  cv::Mat laplacian;
  cv::Laplacian(image, laplacian, CV_64F);
  cv::Scalar mean, deviation;
  cv::meanStdDev(laplacian, mean, deviation);
  return deviation[1] * deviation[1];
}

TEST(subject, is_closed_upright_and_of_the_given_stature) {
  SubjectOptions options;
  options.stature = 1.83;
  const Subject subject = make_subject(options);
  std::map<std::pair<int, int>, int> edges;
  double volume = 0;
  for (const Eigen::Vector3i& t : subject.mesh.triangles) {
    for (int k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
    const auto& v = subject.mesh.vertices;
    volume += v[t[0]].dot(v[t[1]].cross(v[t[2]])) / 6;
  }
  int open = 0;
  for (const auto& [edge, count] : edges) open += edges.count({edge.second, edge.first}) != 1 || count != 1;
  EXPECT_EQ(open, 0);
  EXPECT_NEAR(subject.stature, 1.83, 0.006);
  EXPECT_GT(volume, 0.05);  // positive: triangles face outwards
  EXPECT_LT(volume, 0.12);
  EXPECT_EQ(subject.joints.size(), 23u);
  EXPECT_EQ(subject.materials.size(), subject.mesh.triangles.size());
  const ClosestPoint surface(subject.mesh);
  for (const NamedJoint& joint : subject.joints) {
    if (joint.name == "HeadEnd") continue;
    const auto nearest = surface.nearest(joint.position);
    EXPECT_LT(nearest->normal.dot(joint.position - nearest->position), 0) << joint.name << " lies outside the body";
  }
}

TEST(subject, its_left_is_at_positive_x) {
  for (const NamedJoint& joint : shared_capture().subject.joints) {
    const double side = joint.name.starts_with("Left") ? 1 : joint.name.starts_with("Right") ? -1 : 0;
    EXPECT_GE(side * joint.position.x(), 0.02 * std::abs(side)) << joint.name;
  }
}

// A ray through a pixel, found by inverting the lens, must hit the point whose colour the pixel shows: the renderer's
// projection, the written pose and camera, and the texture agree.
TEST(capture, pixels_show_the_points_the_truth_says) {
  const Capture& capture = shared_capture();
  for (const int index : {0, 7, 45}) {
    const FrameTruth& frame = capture.frames[index];
    ASSERT_FALSE(frame.blurred);
    const cv::Mat image = render_frame(capture, index);
    const cv::Mat mask = render_mask(capture, index);
    const ClosestPoint surface(subject_at(capture, index));
    const Pose world_from_cam = frame.cam_from_world.inverse();
    std::vector<int> differences;
    int disagree = 0, inside = 0;
    for (int y = 2; y < image.rows; y += 3)
      for (int x = 2; x < image.cols; x += 3) {
        const Eigen::Vector2d ray = capture.camera.normalised_from_pixel({x + 0.5, y + 0.5});
        const Eigen::Vector3d direction = world_from_cam.rotation * ray.homogeneous();
        const auto hit = surface.first_hit(world_from_cam.translation, direction);
        disagree += hit.has_value() != (mask.at<std::uint8_t>(y, x) > 0);
        if (!hit || mask.at<std::uint8_t>(y, x) == 0) continue;
        ++inside;
        const Eigen::Vector3d rest = frame.world_from_subject.inverse() * hit->position;
        const Eigen::Vector3f albedo =
            capture.appearance.albedo(capture.subject.materials[hit->triangle], rest.cast<float>(),
                                      Eigen::Vector3f::UnitY(), static_cast<float>(hit->distance / capture.camera.fx));
        // Light scales the three channels alike; their ratio is the albedo's.
        const cv::Vec3b bgr = image.at<cv::Vec3b>(y, x);
        const Eigen::Vector3f seen = decode_srgb(bgr[2], bgr[1], bgr[0]);
        const Rgb expected = encode_srgb(albedo * (seen.sum() / albedo.sum()));
        differences.push_back(std::abs(expected[0] - bgr[2]) + std::abs(expected[2] - bgr[0]));
      }
    ASSERT_GT(inside, 100);
    EXPECT_LE(disagree, 3);  // silhouettes within rounding
    std::sort(differences.begin(), differences.end());
    EXPECT_LE(differences[differences.size() * 95 / 100], 4);
  }
}

TEST(capture, hurried_frames_are_flagged_and_blurred) {
  Capture capture = shared_capture();
  std::vector<int> blurred;
  for (const FrameTruth& frame : capture.frames) {
    if (frame.blurred) blurred.push_back(frame.index);
    EXPECT_EQ(frame.exposure_s > 0, frame.blurred);
  }
  ASSERT_FALSE(blurred.empty());
  const int index = blurred[blurred.size() / 2];
  const double with_blur = sharpness(render_frame(capture, index));
  capture.frames[index].blurred = false;
  capture.frames[index].exposure_s = 0;
  EXPECT_GT(sharpness(render_frame(capture, index)), 1.3 * with_blur);
  EXPECT_GT(capture.frames[index].speed_deg_s, 2 * capture.frames[50].speed_deg_s);
}

TEST(capture, stopped_frames_only_shake) {
  const Capture& capture = shared_capture();
  const FrameTruth* last = nullptr;
  int stopped = 0;
  for (const FrameTruth& frame : capture.frames) {
    if (frame.stopped && last != nullptr && last->stopped) {
      EXPECT_LT((centre_of(frame.cam_from_world) - centre_of(last->cam_from_world)).norm(), 0.03);
    }
    stopped += frame.stopped;
    last = &frame;
  }
  EXPECT_GE(stopped, 2);
}

TEST(capture, sway_reaches_but_never_exceeds_its_amplitude_and_keeps_the_soles) {
  const double largest = shared_capture().options.sway_deg * M_PI / 180;
  double reached = 0;
  for (const FrameTruth& frame : shared_capture().frames) {
    reached = std::max(reached, angle_between(frame.world_from_subject.rotation, Eigen::Quaterniond::Identity()));
    EXPECT_EQ((frame.world_from_subject * Eigen::Vector3d::Zero()).norm(), 0);
  }
  EXPECT_LE(reached, largest * 1.0001);
  EXPECT_GE(reached, largest * 0.4);
  CaptureOptions still = small_options();
  for (const FrameTruth& frame : make_capture(still).frames)
    EXPECT_EQ(angle_between(frame.world_from_subject.rotation, Eigen::Quaterniond::Identity()), 0);
}

TEST(capture, noise_has_the_given_strength_and_defocus_softens) {
  CaptureOptions options = small_options();
  options.noise = 3;
  options.defocus_px = 2;
  const Capture noisy = make_capture(options);
  Capture clean = noisy;
  clean.options.noise = 0;
  cv::Mat difference;
  cv::subtract(render_frame(noisy, 0), render_frame(clean, 0), difference, cv::noArray(), CV_64F);
  cv::Scalar mean, deviation;
  cv::meanStdDev(difference, mean, deviation);
  EXPECT_NEAR(mean[1], 0, 0.1);
  EXPECT_GT(deviation[1], 2.0);
  EXPECT_LT(deviation[1], 4.0);
  const auto soft =
      std::find_if(clean.frames.begin(), clean.frames.end(), [](const FrameTruth& f) { return f.defocused; });
  ASSERT_NE(soft, clean.frames.end());
  const double with_defocus = sharpness(render_frame(clean, soft->index));
  soft->defocused = false;
  EXPECT_GT(sharpness(render_frame(clean, soft->index)), 2 * with_defocus);
}

TEST(capture, the_seed_decides_every_pixel) {
  const auto picture = [](std::uint64_t seed) {
    CaptureOptions options = small_options();
    options.frames = 10;
    options.seed = seed;
    return render_frame(make_capture(options), 3);
  };
  const cv::Mat a = picture(5), b = picture(5), c = picture(6);
  EXPECT_EQ(cv::norm(a, b, cv::NORM_INF), 0);
  EXPECT_GT(cv::norm(a, c, cv::NORM_L1) / static_cast<double>(a.total()), 10);
}

TEST(capture, turn_keeps_the_camera_and_turns_the_subject_once) {
  CaptureOptions options = small_options();
  options.sequence = Sequence::turn;
  options.stop = options.rush = false;
  const Capture capture = make_capture(options);
  EXPECT_NEAR((centre_of(capture.frames[0].cam_from_world) - centre_of(capture.frames[30].cam_from_world)).norm(), 0,
              1e-12);
  EXPECT_GT(capture.frames.back().subject_yaw, 2 * M_PI);
  const Eigen::Vector3d left(1, 0, 0);
  EXPECT_LT((capture.frames[15].world_from_subject * left).z(), -0.7);  // a quarter counter-clockwise from above
}

TEST(write_capture, video_truth_and_meshes_read_back) {
  CaptureOptions options = small_options();
  options.frames = 8;
  const Capture capture = make_capture(options);
  const TemporaryFolder temporary;
  const std::filesystem::path& folder = temporary.path();
  WriteOptions small;
  small.texture_size = 1024;
  const auto written = write_capture(capture, folder, small);
  ASSERT_TRUE(written) << written.error().message();
  cv::VideoCapture video((folder / "video.mp4").string());
  cv::Mat image;
  int count = 0;
  while (video.read(image)) {
    EXPECT_GT(cv::PSNR(image, render_frame(capture, count)), 28) << "frame " << count;
    ++count;
  }
  EXPECT_EQ(count, 8);
  std::ifstream file(folder / "truth.json");
  const nlohmann::json truth = nlohmann::json::parse(file);
  EXPECT_EQ(truth.at("format"), "synth-capture-1");
  ASSERT_EQ(truth.at("frames").size(), 8u);
  const Eigen::Matrix4d pose = capture.frames[5].cam_from_world.matrix();
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c)
      EXPECT_NEAR(truth["frames"][5]["cam_from_world"][r][c].get<double>(), pose(r, c), 1e-12);
  for (const char* name : {"joints.json", "mesh.ply", "mesh_full.ply", "mesh.obj", "texture.png", "masks/000000.png"})
    EXPECT_TRUE(std::filesystem::exists(folder / name)) << name;
}

}  // namespace
}  // namespace gyre::synthetic
