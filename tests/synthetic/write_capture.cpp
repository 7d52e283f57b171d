// SPDX-License-Identifier: Apache-2.0
#include "tests/synthetic/write_capture.h"

#include "common/bundle/atomic_file.h"
#include "common/mesh/mesh_io.h"
#include "common/parallel/parallel.h"
#include "tests/synthetic/atlas.h"

#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>

namespace gyre::synthetic {

namespace {

using nlohmann::json;

constexpr double degrees = 180.0 / M_PI;

json to_array(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

json to_array(const Pose& pose) {
  const Eigen::Matrix4d m = pose.matrix();
  json rows = json::array();
  for (int r = 0; r < 4; ++r) rows.push_back({m(r, 0), m(r, 1), m(r, 2), m(r, 3)});
  return rows;
}

std::string numbered(int index, const char* suffix) {
  std::string digits = std::to_string(index);
  return std::string(6 - std::min<std::size_t>(6, digits.size()), '0') + digits + suffix;
}

std::string sequence_name(Sequence sequence) {
  switch (sequence) {
    case Sequence::orbit_body:
      return "orbit_body";
    case Sequence::orbit_head:
      return "orbit_head";
    case Sequence::turn:
      return "turn";
  }
  return "turn";
}

json frame_json(const Capture& capture, const FrameTruth& frame) {
  json joints = json::object();
  for (const NamedJoint& joint : capture.subject.joints)
    joints[joint.name] = to_array(joint_position(capture, frame.index, joint));
  return {{"index", frame.index},
          {"time", frame.time},
          {"cam_from_world", to_array(frame.cam_from_world)},
          {"blurred", frame.blurred},
          {"defocused", frame.defocused},
          {"stopped", frame.stopped},
          {"exposure_s", frame.exposure_s},
          {"defocus_radius_px", frame.defocus_radius_px},
          {"gain", frame.gain},
          {"camera_speed_deg_s", frame.speed_deg_s},
          {"segment", frame.segment},
          {"subject_yaw_deg", frame.subject_yaw * degrees},
          {"pose",
           {{"sway_roll_deg", frame.sway_roll * degrees},
            {"sway_pitch_deg", frame.sway_pitch * degrees},
            {"translation", to_array(frame.world_from_subject.translation)}}},
          {"joints", joints}};
}

Result<void> write_picture(const cv::Mat& image, const std::filesystem::path& file,
                           const std::vector<int>& settings = {}) {
  try {
    if (cv::imwrite(file.string(), image, settings)) return {};
  } catch (const cv::Exception&) {
  }
  return fail("cannot write picture", file.string(), "check the folder and the free space");
}

// Renders in batches on all cores and hands the frames over in their order.
Result<void> for_each_frame(const Capture& capture, int threads,
                            const std::function<Result<void>(int, const cv::Mat&)>& use) {
  const int count = static_cast<int>(capture.frames.size());
  constexpr int batch = 16;
  for (int first = 0; first < count; first += batch) {
    std::vector<cv::Mat> images(std::min(batch, count - first));
    parallel_for(images.size(), threads,
                 [&](std::size_t i) { images[i] = render_frame(capture, first + static_cast<int>(i)); });
    for (std::size_t i = 0; i < images.size(); ++i)
      if (auto used = use(first + static_cast<int>(i), images[i]); !used) return used;
  }
  return {};
}

Result<void> write_video(const Capture& capture, const std::filesystem::path& file, int threads) {
  try {
    cv::VideoWriter video(file.string(), cv::CAP_FFMPEG, cv::VideoWriter::fourcc('m', 'p', '4', 'v'),
                          capture.options.fps, {capture.camera.width, capture.camera.height});
    if (!video.isOpened())
      return fail("cannot write video", file.string(), "check the folder and OpenCV's FFmpeg support");
    return for_each_frame(capture, threads, [&](int, const cv::Mat& image) -> Result<void> {
      video.write(image);
      return {};
    });
  } catch (const cv::Exception& error) {
    return fail("cannot write video", file.string(), error.what());
  }
}

}  // namespace

json truth_json(const Capture& capture) {
  const Camera& c = capture.camera;
  json frames = json::array();
  for (const FrameTruth& frame : capture.frames) frames.push_back(frame_json(capture, frame));
  return {{"format", "synth-capture-1"},
          {"subject", "synthetic"},
          {"sequence", sequence_name(capture.options.sequence)},
          {"variant", capture.options.sway_deg > 0 ? "sway" : "still"},
          {"fps", capture.options.fps},
          {"frame_count", capture.frames.size()},
          {"camera",
           {{"width", c.width},
            {"height", c.height},
            {"fx", c.fx},
            {"fy", c.fy},
            {"cx", c.cx},
            {"cy", c.cy},
            {"k1", c.k1},
            {"k2", c.k2},
            {"p1", c.p1},
            {"p2", c.p2},
            {"k3", c.k3}}},
          {"subject_info", {{"height_m", capture.subject.stature}}},
          {"world", "metres, right handed, Y up, floor at y=0, subject at the origin facing +Z"},
          {"seed", capture.options.seed},
          {"frames", frames}};
}

json joints_json(const Capture& capture) {
  json joints = json::array();
  for (const NamedJoint& joint : capture.subject.joints)
    joints.push_back({{"name", joint.name},
                      {"parent", joint.parent.empty() ? json() : json(joint.parent)},
                      {"position", to_array(joint_position(capture, 0, joint))}});
  return {{"frame", 0}, {"units", "m"}, {"joints", joints}};
}

TriangleMesh subject_at(const Capture& capture, int index) {
  const Pose& world_from_subject = capture.frames[index].world_from_subject;
  TriangleMesh mesh = capture.subject.mesh;
  for (Eigen::Vector3d& v : mesh.vertices) v = world_from_subject * v;
  for (Eigen::Vector3d& n : mesh.normals) n = world_from_subject.rotation * n;
  return mesh;
}

Result<void> write_capture(const Capture& capture, const std::filesystem::path& folder, const WriteOptions& options) {
  std::error_code failed;
  std::filesystem::create_directories(folder / "masks", failed);
  if (!failed && options.pictures == PictureFormat::images)
    std::filesystem::create_directories(folder / "frames", failed);
  if (failed) return fail("cannot create folder", folder.string(), failed.message());

  TriangleMesh mesh = subject_at(capture, 0);
  const cv::Mat atlas = bake_atlas(capture, mesh, options.texture_size);
  const auto write_texts = [&]() -> Result<void> {
    return write_file(folder / "truth.json", truth_json(capture).dump(1))
        .and_then([&] { return write_file(folder / "joints.json", joints_json(capture).dump(1)); })
        .and_then([&] { return write_ply(mesh, folder / "mesh.ply"); })
        .and_then([&] { return write_ply(mesh, folder / "mesh_full.ply"); })
        .and_then([&] { return write_obj(mesh, folder / "mesh.obj"); })
        .and_then([&] { return write_picture(atlas, folder / "texture.png"); });
  };
  if (auto written = write_texts(); !written) return written;
  for (std::size_t i = 0; i < capture.frames.size(); i += 10) {
    const int index = static_cast<int>(i);
    auto written = write_picture(render_mask(capture, index), folder / "masks" / numbered(index, ".png"));
    if (!written) return written;
  }
  if (options.pictures == PictureFormat::video) return write_video(capture, folder / "video.mp4", options.threads);
  return for_each_frame(capture, options.threads, [&](int index, const cv::Mat& image) {
    return write_picture(image, folder / "frames" / numbered(index, ".jpg"),
                         {cv::IMWRITE_JPEG_QUALITY, options.jpeg_quality});
  });
}

}  // namespace gyre::synthetic
