// SPDX-License-Identifier: Apache-2.0
#include "offload/report/evaluate.h"

#include "common/bundle/atomic_file.h"
#include "common/geometry/colmap_model.h"
#include "common/mesh/mesh_io.h"
#include "common/parallel/parallel.h"
#include "common/render/rasterise.h"
#include "offload/body/template.h"
#include "offload/body/texture_file.h"
#include "offload/report/camera_errors.h"
#include "offload/report/held_out_views.h"
#include "offload/report/json_fields.h"
#include "offload/report/statistics.h"
#include "offload/report/surface_errors.h"
#include "offload/report/texture_errors.h"
#include "offload/report/truth.h"
#include "offload/report/view_errors.h"

#include <nlohmann/json.hpp>
#include <numeric>
#include <opencv2/imgcodecs.hpp>
#include <optional>

namespace gyre {

namespace {

using nlohmann::json;

constexpr double mm = 1000.0;
constexpr double degrees = 180.0 / M_PI;

// All that the single figures are computed from.
struct Inputs {
  Bundle bundle;
  Truth truth;
  std::vector<FrameId> keyframes;
  EvaluateOptions options;
  ColmapModel model;
  CameraErrors cameras;

  // The pass whose first frame stands for the captured pose.
  const TruthPass& main_pass() const {
    for (const char* name : {"body", "turn", "head"})
      if (const auto found = truth.find(name); found != truth.end()) return found->second;
    return truth.begin()->second;
  }
};

json registration(const Inputs& in) {
  std::map<std::string, std::pair<int, int>> passes;  // registered, all
  for (const FrameId& frame : in.keyframes) ++passes[frame.pass].second;
  for (const auto& [id, image] : in.model.images)
    if (const auto name = parse_frame_name(image.name)) ++passes[name->pass].first;
  json by_pass = json::object();
  int registered = 0, all = 0;
  for (const auto& [name, counts] : passes) {
    by_pass[name] = {{"registered", counts.first}, {"keyframes", counts.second}};
    registered += counts.first;
    all += counts.second;
  }
  return {{"share", all > 0 ? static_cast<double>(registered) / all : 0.0},
          {"registered", registered},
          {"keyframes", all},
          {"passes", by_pass}};
}

json camera_figures(const CameraErrors& errors) {
  return {{"centre_mm", summary(errors.centre, mm)},
          {"rotation_deg", summary(errors.rotation, degrees)},
          {"scale", errors.truth_from_model.scale},
          {"centre_at_own_scale_mm", summary(errors.true_scale_centre, mm)}};
}

json distance_figures(std::span<const double> distances) {
  json figures = summary(distances, mm);
  figures["within_5mm"] = share_within(distances, 0.005);
  figures["within_10mm"] = share_within(distances, 0.010);
  return figures;
}

Result<json> cloud_figures(const Inputs& in) {
  const auto cloud = read_cloud(in.bundle.work("cloud") / "cloud.ply");
  if (!cloud) return tl::unexpected(cloud.error());
  std::vector<Eigen::Vector3d> points;
  for (const Eigen::Vector3f& p : cloud->points) points.emplace_back(in.cameras.truth_from_model * p.cast<double>());
  if (points.empty()) return fail("the cloud is empty");
  const TriangleMesh& surface = in.main_pass().surface;
  const auto samples = sample_surface(surface, in.options.surface_samples, in.options.seed);
  return json{{"points", points.size()},
              {"accuracy_mm", distance_figures(distances_to_surface(points, surface, in.options.threads))},
              {"completeness_mm", distance_figures(distances_to_cloud(samples, points, in.options.threads))}};
}

// The fit and where it lies in the true world.
struct AlignedFit {
  TriangleMesh posed;         // world of the bundle
  std::vector<int> visible;   // vertices a true camera sees
  Similarity rigid, similar;  // truth from bundle: at the bundle's own scale, and at the best one
};

Result<AlignedFit> align_fit(const Inputs& in) {
  auto posed = read_ply(in.bundle.work("fit") / "posed.ply");
  if (!posed) return tl::unexpected(posed.error());
  if (posed->triangles.empty())
    return fail("the fitted mesh has no triangles", "work/fit/posed.ply", "run the stage fit again");
  AlignedFit fit;
  fit.posed = std::move(*posed);
  // Start from the cameras; for the rigid one, about the middle of the fit, so that a wrong scale does not move it
  // away.
  const Similarity& start = in.cameras.truth_from_model;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& v : fit.posed.vertices) middle += v / static_cast<double>(fit.posed.vertices.size());
  Similarity unscaled{1.0, start.rotation, Eigen::Vector3d::Zero()};
  unscaled.translation = start * middle - unscaled.rotation * middle;

  TriangleMesh in_truth = fit.posed;
  for (Eigen::Vector3d& v : in_truth.vertices) v = start * v;
  std::vector<std::pair<Camera, Pose>> cameras;
  for (const auto& [name, pass] : in.truth)
    for (const auto& [index, pose] : pass.cam_from_world) cameras.emplace_back(pass.camera, pose);
  fit.visible = visible_vertices(in_truth, cameras, in.options.threads);

  SurfaceAlignmentOptions options;
  options.seed = in.options.seed;
  const TriangleMesh& surface = in.main_pass().surface;
  fit.rigid = align_surfaces(surface, fit.posed, fit.visible, unscaled, options);
  options.with_scale = true;
  fit.similar = align_surfaces(surface, fit.posed, fit.visible, start, options);
  return fit;
}

json surface_figures(const Inputs& in, const AlignedFit& fit) {
  const TriangleMesh& surface = in.main_pass().surface;
  const auto samples = sample_surface(surface, in.options.surface_samples, in.options.seed);
  const auto both_ways = [&](const Similarity& truth_from_bundle) -> json {
    TriangleMesh moved = fit.posed;
    for (Eigen::Vector3d& v : moved.vertices) v = truth_from_bundle * v;
    std::vector<Eigen::Vector3d> visible;
    for (const int i : fit.visible) visible.push_back(moved.vertices[i]);
    return {{"true_to_fitted_mm", summary(distances_to_surface(samples, moved, in.options.threads), mm)},
            {"fitted_to_true_mm", summary(distances_to_surface(visible, surface, in.options.threads), mm)},
            {"scale", truth_from_bundle.scale}};
  };
  return {{"rigid", both_ways(fit.rigid)},
          {"similarity", both_ways(fit.similar)},
          {"visible_vertices", fit.visible.size()},
          {"vertices", fit.posed.vertices.size()}};
}

Result<json> read_fit(const Bundle& bundle) {
  const std::filesystem::path file = bundle.work("fit") / "fit.json";
  const auto text = read_file(file);
  if (!text) return tl::unexpected(text.error());
  json fit = json::parse(*text, nullptr, false);
  if (!fit.is_object()) return fail("cannot read the fit", file.string(), "run the stage fit again");
  return fit;
}

Result<json> joint_figures(const Inputs& in, const json& fit, const Similarity& truth_from_bundle) {
  json by_name = json::object();
  std::vector<double> errors;
  try {
    for (const auto& [name, truth] : in.main_pass().joints) {
      if (!fit.at("joints").contains(name)) continue;
      const auto p = fit["joints"][name].get<std::array<double, 3>>();
      errors.push_back((truth_from_bundle * Eigen::Vector3d(p[0], p[1], p[2]) - truth).norm());
      by_name[name] = mm * errors.back();
    }
  } catch (const json::exception& error) {
    return fail("cannot read the joints of the fit", error.what());
  }
  if (errors.empty()) return fail("fit and truth have no joint in common");
  json figures = summary(errors, mm);
  figures["by_name"] = by_name;
  return figures;
}

// The fitted mesh with the template's texture coordinates, and its texture.
struct Textured {
  TriangleMesh mesh;
  cv::Mat albedo;
};

Result<Textured> textured_fit(const Inputs& in, const json& fit, const TriangleMesh& posed) {
  const std::filesystem::path file = texture_file(in.bundle, "albedo");
  if (!std::filesystem::exists(file)) return fail("no texture", file.string(), "run the stage texture");
  Textured textured;
  try {
    textured.albedo = cv::imread(file.string(), cv::IMREAD_COLOR);
  } catch (const cv::Exception&) {
  }
  if (textured.albedo.empty()) return fail("cannot read the texture", file.string(), "run the stage texture again");
  auto body = find_template(in.options.body_template);
  if (!body) return tl::unexpected(body.error());
  if (text_at(fit, "/template/checksum") != body->checksum)
    return fail("the fit was made with another template than " + body->name, "", "give that template with --template");
  if (posed.vertices.size() != body->mesh.vertices.size())
    return fail("the fitted mesh does not have the template's vertices", "work/fit/posed.ply",
                "run the stage fit again");
  textured.mesh = body->mesh;
  textured.mesh.vertices = posed.vertices;
  textured.mesh.normals.clear();
  return textured;
}

Result<json> view_figures(const Inputs& in, const Textured& textured) {
  struct View {
    const ModelImage* image;
    const TruthPass* pass;
    Pose true_pose;
  };
  std::vector<View> views;
  for (const auto& [id, image] : in.model.images) {
    const auto name = parse_frame_name(image.name);
    if (!name || !in.truth.contains(name->pass)) continue;
    const TruthPass& pass = in.truth.at(name->pass);
    if (const auto pose = pass.cam_from_world.find(name->index); pose != pass.cam_from_world.end())
      views.push_back({&image, &pass, pose->second});
  }
  std::vector<ColourError> errors(views.size());
  std::vector<std::pair<double, double>> sharp(views.size());  // of the photograph and of what is rendered
  std::vector<char> unreadable(views.size(), 0);
  ShadeOptions unlit;  // the light of the capture is in the texture
  unlit.lit = false;
  parallel_for(views.size(), in.options.threads, [&](std::size_t i) {
    const View& view = views[i];
    cv::Mat photo;
    try {
      photo = cv::imread((in.bundle.frames() / view.image->name).string(), cv::IMREAD_COLOR);
    } catch (const cv::Exception&) {
    }
    const Camera& camera = in.model.camera_of(*view.image);
    if (photo.cols != camera.width || photo.rows != camera.height || camera.width != view.pass->camera.width ||
        camera.height != view.pass->camera.height) {
      unreadable[i] = 1;
      return;
    }
    const cv::Mat rendered = render(textured.mesh, textured.albedo, camera, view.image->cam_from_world, unlit);
    const cv::Mat shown = silhouette(textured.mesh, camera, view.image->cam_from_world);
    const cv::Mat real = silhouette(view.pass->surface, view.pass->camera, view.true_pose);
    errors[i] = colour_error(rendered, photo, shown, real);
    const cv::Mat both = shown & real;
    sharp[i] = {sharpness(photo, both), sharpness(rendered, both)};
  });
  ColourError all;
  std::vector<double> single;
  json by_name = json::object();
  double photographed = 0.0, shown = 0.0;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    all.squared += errors[i].squared;
    all.pixels += errors[i].pixels;
    photographed += sharp[i].first;
    shown += sharp[i].second;
    if (errors[i].pixels == 0) continue;
    single.push_back(errors[i].rmse());
    by_name[views[i].image->name] = single.back();
  }
  if (all.pixels == 0) return fail("no keyframe shows the rendered subject inside both silhouettes");
  return json{
      {"cielab_rmse", all.rmse()},
      {"mean_of_views", std::accumulate(single.begin(), single.end(), 0.0) / static_cast<double>(single.size())},
      {"worst_view", *std::max_element(single.begin(), single.end())},
      {"by_view", by_name},
      {"sharpness_ratio", photographed > 0 ? shown / photographed : 0.0},
      {"views", single.size()},
      {"unreadable", std::count(unreadable.begin(), unreadable.end(), 1)},
      {"pixels", all.pixels},
      {"colour_space", "CIE 1976 L*a*b*, D65, sRGB linearised"}};
}

Result<json> seam_figures(const Inputs& in, const Textured& textured) {
  const std::filesystem::path file = in.bundle.work("texture") / "view.png";
  if (!std::filesystem::exists(file)) return fail("no map of views", file.string(), "run the stage texture again");
  cv::Mat view;
  try {
    view = cv::imread(file.string(), cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception&) {
  }
  if (view.type() != CV_16U || view.size() != textured.albedo.size()) {
    return fail("the map of views does not belong to the texture", file.string(), "run the stage texture again");
  }
  const SeamEnergy energy = seam_energy(textured.albedo, view, textured.mesh);
  return json{{"border", energy.border},
              {"interior", energy.interior},
              {"ratio", energy.ratio()},
              {"charts", energy.charts},
              {"unit", "encoded levels between neighbouring texels"}};
}

bool captured(const std::vector<FrameId>& keyframes, const std::string& pass) {
  return std::any_of(keyframes.begin(), keyframes.end(), [&](const FrameId& f) { return f.pass == pass; });
}

// True when the cameras stage has told by itself that the subject turns. A recording is taken in as pass "body"
// whatever it shows, so a turn's truth then goes by that name.
bool found_turning(const Bundle& bundle) {
  const auto text = read_file(bundle.work("cameras") / "scene.json");
  if (!text) return false;
  const json scene = json::parse(*text, nullptr, false);
  return scene.is_object() && text_at(scene, "/motion") == "turn";
}

}  // namespace

Result<json> evaluate(const Bundle& bundle, const std::filesystem::path& truth_folder, const EvaluateOptions& options) {
  auto truth = read_truth(truth_folder);
  if (!truth) return tl::unexpected(truth.error());
  const auto scan = read_scan(bundle);
  if (!scan) return tl::unexpected(scan.error());
  auto keyframes = list_frames(bundle);
  if (!keyframes) return tl::unexpected(keyframes.error());
  if (found_turning(bundle) && truth->contains("turn") && !captured(*keyframes, "turn"))
    (*truth)["body"] = truth->at("turn");
  // Only passes that were captured: the camera of an absent head pass sees nothing.
  std::erase_if(*truth, [&](const auto& pass) { return !captured(*keyframes, pass.first); });
  if (truth->empty()) return wrong_use("the truth is of other passes than the bundle", truth_folder.string());

  Inputs in{bundle, std::move(*truth), std::move(*keyframes), options, {}, {}};
  json answer = {{"scan", scan->id},    {"registered", nullptr},    {"cameras", nullptr}, {"cloud", nullptr},
                 {"surface", nullptr},  {"joints", nullptr},        {"views", nullptr},   {"seams", nullptr},
                 {"held_out", nullptr}, {"missing", json::object()}};
  const auto missing = [&](std::initializer_list<const char*> parts, const Error& why) {
    for (const char* part : parts) answer["missing"][part] = why.message();
  };
  const auto put = [&](const char* part, const Result<json>& figures) {
    if (figures) {
      answer[part] = *figures;
    } else {
      missing({part}, figures.error());
    }
  };

  auto model = read_colmap_model(bundle.work("cameras"));
  if (!model) {
    missing({"registered", "cameras", "cloud", "surface", "joints", "views", "seams", "held_out"}, model.error());
    return answer;
  }
  in.model = std::move(*model);
  answer["registered"] = registration(in);
  auto cameras = camera_errors(in.model, in.truth);
  if (!cameras) {  // nothing can be aligned
    missing({"cameras", "cloud", "surface", "joints", "views", "seams", "held_out"}, cameras.error());
    return answer;
  }
  in.cameras = std::move(*cameras);
  answer["cameras"] = camera_figures(in.cameras);
  options.progress(0.1, "cloud");
  put("cloud", cloud_figures(in));

  options.progress(0.3, "surface");
  const auto aligned = align_fit(in);
  if (!aligned) {
    missing({"surface", "joints", "views", "seams", "held_out"}, aligned.error());
    return answer;
  }
  answer["surface"] = surface_figures(in, *aligned);
  const auto fit = read_fit(bundle);
  if (!fit) {
    missing({"joints", "views", "seams", "held_out"}, fit.error());
    return answer;
  }
  put("joints", joint_figures(in, *fit, aligned->rigid));
  options.progress(0.6, "views");
  const auto textured = textured_fit(in, *fit, aligned->posed);
  if (textured) {
    put("views", view_figures(in, *textured));
    options.progress(0.8, "seams and held-out frames");
    put("seams", seam_figures(in, *textured));
    put("held_out",
        held_out_figures(in.truth, in.keyframes, in.cameras.truth_from_model, textured->mesh, textured->albedo));
  } else {
    missing({"views", "seams", "held_out"}, textured.error());
  }
  options.progress(1.0, "done");
  return answer;
}

}  // namespace gyre
