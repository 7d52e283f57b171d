// SPDX-License-Identifier: Apache-2.0
#include "tests/synthetic/capture.h"

#include "common/render/rasterise.h"
#include "tests/synthetic/noise.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace gyre::synthetic {

namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr double blur_exposure = 1.0 / 30.0;  // seconds
constexpr int blur_samples = 9;

// Direct light of two windows and what the room sends back, as a factor on linear reflectance.
float irradiance(const Vector3f& normal) {
  static const Vector3f key = Vector3f(0.5f, 0.75f, 0.6f).normalized();
  static const Vector3f fill = Vector3f(-0.7f, 0.4f, -0.5f).normalized();
  const float sky = 0.5f + 0.5f * normal.y();
  return 0.42f + 0.22f * sky + 0.42f * std::max(0.0f, normal.dot(key)) + 0.22f * std::max(0.0f, normal.dot(fill));
}

double azimuth_of(const Pose& cam_from_world) {
  const Vector3d c = centre_of(cam_from_world);
  return std::atan2(c.x(), c.z());
}

// Outside the rings of an orbit, across from the camera and swinging to both sides of the subject.
Pose world_from_passer_by(const Capture& capture, double time) {
  constexpr double radius = 2.6, period = 12.0, swing = 0.2;
  const double phase = 2 * M_PI * time / period;
  const double azimuth = azimuth_of(capture.trajectory.cam_from_world(time)) + M_PI + swing * std::sin(phase);
  return {Eigen::Quaterniond(Eigen::AngleAxisd(azimuth + M_PI / 2, Vector3d::UnitY())),
          {radius * std::sin(azimuth), 0, radius * std::cos(azimuth)}};
}

// A mesh where it stands.
struct Thing {
  const TriangleMesh* mesh;
  const std::vector<Material>* materials;
  const Appearance* appearance;
  Pose world_from_thing;
};

// Everything there is as one mesh; the subject comes first.
struct Scene {
  std::vector<Thing> things;
  std::vector<int> first_vertex;    // one a thing
  std::vector<int> first_triangle;  // one a thing
  std::vector<Vector3d> vertices;
  std::vector<Eigen::Vector3i> triangles;
};

Scene scene_at(const Capture& capture, double time, const Pose& world_from_subject) {
  Scene scene;
  scene.things.push_back({&capture.subject.mesh, &capture.subject.materials, &capture.appearance, world_from_subject});
  scene.things.push_back({&capture.room.mesh, &capture.room.materials, &capture.appearance, Pose{}});
  if (capture.passer_by) {
    const PasserBy& other = *capture.passer_by;
    scene.things.push_back(
        {&other.subject.mesh, &other.subject.materials, &other.appearance, world_from_passer_by(capture, time)});
  }
  for (const Thing& thing : scene.things) {
    const Eigen::Matrix3d rotation = thing.world_from_thing.rotation.toRotationMatrix();
    const auto first = static_cast<int>(scene.vertices.size());
    scene.first_vertex.push_back(first);
    scene.first_triangle.push_back(static_cast<int>(scene.triangles.size()));
    for (const Vector3d& v : thing.mesh->vertices)
      scene.vertices.push_back(rotation * v + thing.world_from_thing.translation);
    for (const Eigen::Vector3i& t : thing.mesh->triangles)
      scene.triangles.push_back(t + Eigen::Vector3i::Constant(first));
  }
  return scene;
}

int thing_of(const Scene& scene, int triangle) {
  const auto next = std::upper_bound(scene.first_triangle.begin(), scene.first_triangle.end(), triangle);
  return static_cast<int>(next - scene.first_triangle.begin()) - 1;
}

Material material_of(const Scene& scene, int triangle) {
  const int k = thing_of(scene, triangle);
  return (*scene.things[k].materials)[triangle - scene.first_triangle[k]];
}

// The world behind the mirror: what its pixels show.
VisibilityBuffer rasterise_reflection(Scene& reflected, const Eigen::Hyperplane<double, 3>& mirror,
                                      const Camera& camera, const Pose& cam_from_world) {
  for (Vector3d& v : reflected.vertices) v -= 2 * mirror.signedDistance(v) * mirror.normal();
  for (std::size_t t = 0; t < reflected.triangles.size(); ++t) {
    Eigen::Vector3i& corners = reflected.triangles[t];
    std::swap(corners[1], corners[2]);  // a reflection turns front sides into back sides
    if (material_of(reflected, static_cast<int>(t)) == Material::mirror) corners.setConstant(corners[0]);
  }
  return rasterise(reflected.vertices, reflected.triangles, camera, cam_from_world);
}

// Linear radiance of what a pixel sees.
Vector3f shade(const Scene& scene, const VisibilityBuffer& seen, std::size_t i, float focal) {
  const int t = seen.triangle[i];
  if (t < 0) return Vector3f::Zero();
  const int k = thing_of(scene, t);
  const Thing& thing = scene.things[k];
  const Eigen::Vector3i corner = scene.triangles[t] - Eigen::Vector3i::Constant(scene.first_vertex[k]);
  const Vector3f w(1.0f - seen.weights[i].sum(), seen.weights[i].x(), seen.weights[i].y());
  Vector3f position = Vector3f::Zero(), normal = Vector3f::Zero();
  for (int c = 0; c < 3; ++c) {
    position += w[c] * thing.mesh->vertices[corner[c]].cast<float>();
    normal += w[c] * thing.mesh->normals[corner[c]].cast<float>();
  }
  const Vector3f albedo = thing.appearance->albedo(material_of(scene, t), position, normal, seen.depth[i] / focal);
  normal.normalize();
  return irradiance(thing.world_from_thing.rotation.toRotationMatrix().cast<float>() * normal) * albedo;
}

// Linear radiance, CV_32FC3 BGR, of an instant: the frame's poses, moved on as the trajectory goes.
cv::Mat radiance(const Capture& capture, const FrameTruth& frame, double time, const Camera& camera) {
  const Trajectory& path = capture.trajectory;
  Pose cam_from_world = frame.cam_from_world;
  Pose world_from_subject = frame.world_from_subject;
  if (time != frame.time) {
    cam_from_world = path.cam_from_world(time) * path.cam_from_world(frame.time).inverse() * cam_from_world;
    world_from_subject =
        path.world_from_subject(time) * path.world_from_subject(frame.time).inverse() * world_from_subject;
  }
  const Scene scene = scene_at(capture, time, world_from_subject);
  const VisibilityBuffer seen = rasterise(scene.vertices, scene.triangles, camera, cam_from_world);
  Scene reflected;
  VisibilityBuffer in_mirror;
  if (capture.room.mirror) {
    reflected = scene;
    in_mirror = rasterise_reflection(reflected, *capture.room.mirror, camera, cam_from_world);
  }
  const auto focal = static_cast<float>(camera.fx);
  cv::Mat image(camera.height, camera.width, CV_32FC3, cv::Scalar::all(0));
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const std::size_t i = seen.index(x, y);
      if (seen.triangle[i] < 0) continue;
      const bool mirrors = capture.room.mirror && material_of(scene, seen.triangle[i]) == Material::mirror;
      const Vector3f light = mirrors ? 0.9f * shade(reflected, in_mirror, i, focal) : shade(scene, seen, i, focal);
      image.at<cv::Vec3f>(y, x) = {light.z(), light.y(), light.x()};
    }
  }
  return image;
}

cv::Mat disc_kernel(double radius) {
  const int half = static_cast<int>(std::ceil(radius));
  cv::Mat kernel(2 * half + 1, 2 * half + 1, CV_32F);
  for (int y = -half; y <= half; ++y)
    for (int x = -half; x <= half; ++x)
      kernel.at<float>(y + half, x + half) = static_cast<float>(std::clamp(radius + 0.5 - std::hypot(x, y), 0.0, 1.0));
  return kernel / cv::sum(kernel)[0];
}

// sRGB code (not yet rounded) of linear values in steps of 1/4096: a pixel's cost is one look-up.
const std::vector<float>& srgb_curve() {
  static const std::vector<float> curve = [] {
    std::vector<float> table(4097);
    for (int i = 0; i <= 4096; ++i) {
      const double v = i / 4096.0;
      table[i] = static_cast<float>(255.0 * (v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1.0 / 2.4) - 0.055));
    }
    return table;
  }();
  return curve;
}

// Standard normal numbers to be picked from at random; drawing fresh ones would cost more than rendering.
const std::vector<float>& normal_numbers() {
  static const std::vector<float> numbers = [] {
    std::vector<float> table(1 << 14);
    for (std::size_t i = 0; i < table.size(); i += 2) {  // Box and Muller 1958
      const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform(hash(977, i))));
      const double angle = 2 * M_PI * uniform(hash(978, i));
      table[i] = static_cast<float>(radius * std::cos(angle));
      table[i + 1] = static_cast<float>(radius * std::sin(angle));
    }
    return table;
  }();
  return numbers;
}

// Gain, tone curve, noise of sensor and quantisation.
cv::Mat develop(const cv::Mat& linear, double gain, double noise, std::uint64_t seed) {
  const std::vector<float>& curve = srgb_curve();
  const std::vector<float>& normals = normal_numbers();
  const auto sigma = static_cast<float>(noise);
  cv::Mat image(linear.size(), CV_8UC3);
  std::uint64_t bits = hash(seed, 41) | 1u;
  for (int y = 0; y < image.rows; ++y) {
    const auto* in = linear.ptr<float>(y);
    auto* out = image.ptr<std::uint8_t>(y);
    for (int i = 0; i < 3 * image.cols; ++i) {
      const float v = std::clamp(static_cast<float>(gain) * in[i], 0.0f, 1.0f);
      bits ^= bits << 13;  // xorshift64 (Marsaglia 2003)
      bits ^= bits >> 7;
      bits ^= bits << 17;
      const float code = curve[static_cast<std::size_t>(v * 4096.0f)];
      const float grain = sigma * (0.4f + 0.6f * code / 128.0f) * normals[bits >> 50];
      out[i] = cv::saturate_cast<std::uint8_t>(code + grain);
    }
  }
  return image;
}

}  // namespace

Capture make_capture(const CaptureOptions& options) {
  Capture capture;
  capture.options = options;
  // The lens of the recorded captures: 0.9 of the height, a principal point off the middle, slight barrel distortion.
  Camera& camera = capture.camera;
  camera.width = options.width;
  camera.height = options.height;
  camera.fx = 0.9002 * options.height;
  camera.fy = 0.8991 * options.height;
  camera.cx = 0.4982 * options.width;
  camera.cy = 0.5025 * options.height;
  camera.k1 = -0.05;
  camera.k2 = 0.01;
  SubjectOptions subject;
  subject.stature = options.stature;
  subject.cell = options.cell;
  subject.seed = options.seed;
  capture.subject = make_subject(subject);
  capture.room = make_room(options.seed, {}, options.trouble);
  capture.appearance = Appearance(options.seed, options.stature / 1.70, {}, options.trouble);
  if (options.trouble.passer_by) {
    const std::uint64_t other = hash(options.seed, 71);
    capture.passer_by = PasserBy{make_subject({.cell = options.cell, .seed = other}), Appearance(other)};
  }
  TrajectoryOptions path;
  path.sequence = options.sequence;
  path.duration = options.frames / options.fps;
  path.stature = options.stature;
  path.jitter_mm = options.jitter_mm;
  path.sway_deg = options.sway_deg;
  path.stop = options.stop;
  path.rush = options.rush;
  path.arc_deg = options.trouble.arc_deg;
  path.seed = options.seed;
  capture.trajectory = Trajectory(path);
  const Trajectory& trajectory = capture.trajectory;
  const int hunt = static_cast<int>(0.72 * options.frames), hunt_end = hunt + std::max(1, options.frames * 3 / 100);
  for (int i = 0; i < options.frames; ++i) {
    FrameTruth frame;
    frame.index = i;
    frame.time = (i + 0.5) / options.fps;
    frame.cam_from_world = trajectory.cam_from_world(frame.time);
    frame.world_from_subject = trajectory.world_from_subject(frame.time);
    frame.blurred = trajectory.rushing(frame.time);
    frame.exposure_s = frame.blurred ? std::min(blur_exposure, 1.0 / options.fps) : 0.0;
    frame.stopped = trajectory.stopped(frame.time);
    frame.defocused = options.defocus_px > 0 && i >= hunt && i < hunt_end;
    frame.defocus_radius_px = frame.defocused ? options.defocus_px : 0.0;
    frame.gain = 1.0 + options.exposure_drift * std::sin(2 * M_PI * (1.3 * i / options.frames + 0.1));
    const double turned = azimuth_of(trajectory.cam_from_world(frame.time + 0.01)) -
                          azimuth_of(trajectory.cam_from_world(frame.time - 0.01));
    frame.speed_deg_s = std::abs(std::remainder(turned, 2 * M_PI)) * 180 / M_PI / 0.02;
    frame.subject_yaw = trajectory.yaw(frame.time);
    frame.sway_roll = trajectory.sway_roll(frame.time);
    frame.sway_pitch = trajectory.sway_pitch(frame.time);
    frame.segment = trajectory.segment(frame.time);
    capture.frames.push_back(frame);
  }
  return capture;
}

cv::Mat render_frame(const Capture& capture, int index) {
  const CaptureOptions& options = capture.options;
  const FrameTruth& frame = capture.frames[index];
  const Camera camera = options.samples > 1 ? capture.camera.scaled(options.samples) : capture.camera;
  const int count = frame.blurred ? blur_samples : 1;
  cv::Mat light;
  for (int i = 0; i < count; ++i) {
    const double time = frame.time + ((i + 0.5) / count - 0.5) * frame.exposure_s;
    const cv::Mat instant = radiance(capture, frame, time, camera);
    light = light.empty() ? instant : cv::Mat(light + instant);
  }
  light /= count;
  if (options.samples > 1) cv::resize(light, light, {options.width, options.height}, 0, 0, cv::INTER_AREA);
  if (frame.defocused) cv::filter2D(light, light, -1, disc_kernel(frame.defocus_radius_px));
  return develop(light, frame.gain, options.noise, hash(options.seed, static_cast<std::uint64_t>(index)));
}

cv::Mat render_mask(const Capture& capture, int index) {
  const FrameTruth& frame = capture.frames[index];
  const Scene scene = scene_at(capture, frame.time, frame.world_from_subject);
  const VisibilityBuffer seen = rasterise(scene.vertices, scene.triangles, capture.camera, frame.cam_from_world);
  const auto subject_triangles = static_cast<int>(capture.subject.mesh.triangles.size());
  cv::Mat mask(seen.height, seen.width, CV_8U, cv::Scalar(0));
  for (int y = 0; y < seen.height; ++y)
    for (int x = 0; x < seen.width; ++x) {
      const int t = seen.triangle[seen.index(x, y)];
      if (t >= 0 && t < subject_triangles) mask.at<std::uint8_t>(y, x) = 255;
    }
  return mask;
}

Vector3d joint_position(const Capture& capture, int index, const NamedJoint& joint) {
  return capture.frames[index].world_from_subject * joint.position;
}

}  // namespace gyre::synthetic
