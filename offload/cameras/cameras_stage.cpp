// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/cameras_stage.h"

#include "common/board/find_board.h"
#include "common/bundle/atomic_file.h"
#include "common/geometry/colmap_model.h"
#include "common/parallel/parallel.h"
#include "offload/cameras/correspondence.h"
#include "offload/cameras/joined_passes.h"
#include "offload/cameras/patch_resection.h"
#include "offload/cameras/reconstruction.h"
#include "offload/cameras/ring.h"
#include "offload/cameras/sway.h"
#include "offload/cameras/world_frame.h"

#include <atomic>
#include <numbers>
#include <opencv2/imgproc.hpp>

namespace gyre {

namespace {

using nlohmann::json;

constexpr double assumed_height_mm = 1700.0;
constexpr std::size_t min_pictures = 3;
constexpr std::size_t min_keypoints = 50;     // of the median picture
constexpr double min_registered_share = 0.5;  // fewer are not one model but a fragment
constexpr double wanted_registered_share = 0.9;
constexpr double subject_contrast = 0.5;    // of weaker features that are asked for when the subject is all there is
constexpr double most_more_features = 4.0;  // times as many where a still background takes most of them

// Shares of the stage's time after which a step ends, for progress.
constexpr double features_end = 0.2;
constexpr double background_end = 0.25;
constexpr double matching_end = 0.55;
constexpr double reconstruction_end = 0.97;

Progress part_of(const Progress& whole, double begin, double end) {
  return [=](double fraction, std::string_view what) { whole(begin + (end - begin) * fraction, what); };
}

struct Pictures {
  std::vector<FrameId> ids;
  std::vector<Features> features;
  std::vector<std::vector<BoardCorner>> boards;
  std::vector<int> pass_of;  // index into `passes`
  std::vector<std::string> passes;
  StaticBackground background;
};

// Reads the given pictures, several at once, and hands each to look(index, picture).
Result<void> look_at_pictures(const Pictures& pictures, const std::vector<std::size_t>& which,
                              const StageContext& context, const Progress& progress,
                              const std::function<void(std::size_t, const cv::Mat&)>& look) {
  const std::size_t count = which.size(), at_once = 8;
  std::vector<std::optional<Error>> errors(count);
  for (std::size_t begin = 0; begin < count; begin += at_once) {
    progress(static_cast<double>(begin) / static_cast<double>(count), "finding features");
    parallel_for(std::min(at_once, count - begin), context.threads, [&](std::size_t k) {
      const FrameId& id = pictures.ids[which[begin + k]];
      const Result<cv::Mat> picture = read_upright(context.bundle.frame(id.pass, id.index));
      if (picture) {
        look(which[begin + k], *picture);
      } else {
        errors[begin + k] = picture.error();
      }
    });
  }
  for (const auto& error : errors)
    if (error) return tl::unexpected<Error>(*error);
  return {};
}

Result<Pictures> read_pictures(const StageContext& context, const FeatureOptions& options, const Progress& progress) {
  Result<std::vector<FrameId>> ids = list_frames(context.bundle);
  if (!ids) return tl::unexpected<Error>(ids.error());
  Pictures pictures;
  pictures.ids = std::move(*ids);
  const std::size_t count = pictures.ids.size();
  if (count < min_pictures)
    return fail("too few pictures (" + std::to_string(count) + ") to find cameras", context.bundle.frames().string(),
                "record at least one full walk around the subject");
  pictures.features.resize(count);
  pictures.boards.resize(count);
  std::vector<std::size_t> all(count);
  std::iota(all.begin(), all.end(), std::size_t{0});
  const auto looked = look_at_pictures(pictures, all, context, progress, [&](std::size_t i, const cv::Mat& picture) {
    pictures.features[i] = detect_features(picture, options);
    pictures.boards[i] = find_board(picture);
  });
  if (!looked) return tl::unexpected<Error>(looked.error());
  for (std::size_t i = 0; i < count; ++i) {
    const std::string& pass = pictures.ids[i].pass;
    auto known = std::find(pictures.passes.begin(), pictures.passes.end(), pass);
    if (known == pictures.passes.end()) known = pictures.passes.insert(known, pass);
    pictures.pass_of.push_back(static_cast<int>(known - pictures.passes.begin()));
  }
  return pictures;
}

Result<void> check(const Pictures& pictures) {
  std::map<int, std::pair<int, int>> size_of_pass;
  std::vector<std::size_t> counts;
  for (std::size_t i = 0; i < pictures.ids.size(); ++i) {
    const Features& features = pictures.features[i];
    const std::pair<int, int> size{features.width, features.height};
    if (size_of_pass.try_emplace(pictures.pass_of[i], size).first->second != size)
      return fail("pictures of pass " + pictures.ids[i].pass + " differ in size",
                  frame_name(pictures.ids[i].pass, pictures.ids[i].index),
                  "give pictures of one camera, all in the same orientation and resolution");
    counts.push_back(features.keypoints.size());
  }
  std::nth_element(counts.begin(), counts.begin() + static_cast<std::ptrdiff_t>(counts.size() / 2), counts.end());
  if (counts[counts.size() / 2] < min_keypoints)
    return fail("no texture in the pictures: hardly any features to recognise", "",
                "more light, a sharper focus, or a patterned background and patterned clothes");
  return {};
}

// Tells turns from orbits, and leaves only features that turn with the subject in the pictures of a turn.
Result<void> drop_background(Pictures& pictures, const StageContext& context, FeatureOptions options,
                             const Progress& progress) {
  pictures.background = find_static_background(pictures.features, pictures.pass_of, {}, context.threads);
  std::vector<std::size_t> turned;
  double all = 0.0, moving = 0.0;
  for (std::size_t i = 0; i < pictures.ids.size(); ++i) {
    if (pictures.background.motion[i] != Motion::turn) continue;
    turned.push_back(i);
    const std::vector<char>& still = pictures.background.still[i];
    all += static_cast<double>(still.size());
    moving += static_cast<double>(std::count(still.begin(), still.end(), 0));
  }
  if (turned.empty()) return {};
  // The strongest features are now those of the room and the subject together: the subject is given its own share.
  options.max_features =
      static_cast<int>(options.max_features * std::min(all / std::max(moving, 1.0), most_more_features));
  options.contrast_threshold *= subject_contrast;
  auto looked = look_at_pictures(pictures, turned, context, progress, [&](std::size_t i, const cv::Mat& picture) {
    pictures.features[i] = detect_features(picture, options);
  });
  if (!looked) return looked;
  pictures.background = find_static_background(pictures.features, pictures.pass_of, {}, context.threads);
  for (const std::size_t i : turned)
    pictures.features[i] = without_still(pictures.features[i], pictures.background.still[i]);
  return {};
}

// Pictures of equal size share a camera: the passes were taken with one device.
Scene scene_of(const Pictures& pictures, const std::optional<Camera>& calibrated) {
  Scene scene;
  std::vector<int> next_order(pictures.passes.size(), 0);
  for (std::size_t i = 0; i < pictures.ids.size(); ++i) {
    const Features& features = pictures.features[i];
    View view;
    view.pass = pictures.pass_of[i];
    view.order = next_order[static_cast<std::size_t>(view.pass)]++;
    view.motion = pictures.background.motion[i];
    view.keypoints = features.keypoints;
    const auto same_size = std::find_if(scene.cameras.begin(), scene.cameras.end(), [&](const Camera& c) {
      return c.width == features.width && c.height == features.height;
    });
    view.camera = static_cast<int>(same_size - scene.cameras.begin());
    if (same_size == scene.cameras.end()) {
      Camera camera = calibrated.value_or(Camera{});
      camera.width = features.width;
      camera.height = features.height;
      scene.cameras.push_back(camera);
    }
    scene.views.push_back(std::move(view));
  }
  return scene;
}

CaptureOrder order_of(const Bundle& bundle, const Scan& scan, const Pictures& pictures) {
  CaptureOrder order;
  order.pass_of = pictures.pass_of;
  // Photographs have no frame rate, and their order need not be the order of a walk.
  order.ordered = std::any_of(scan.passes.begin(), scan.passes.end(), [](const ScanPass& p) { return p.fps > 0; });
  // Without a log of the frames the pictures speak for themselves.
  const Result<std::vector<FrameRecord>> records = read_frame_log(bundle);
  if (!records) return order;
  std::map<std::pair<std::string, int>, const FrameRecord*> record_of;
  for (const FrameRecord& record : *records) record_of[{record.pass, record.index}] = &record;
  for (const FrameId& id : pictures.ids) {
    const auto found = record_of.find({id.pass, id.index});
    order.azimuth.push_back(found == record_of.end() ? std::nullopt : found->second->azimuth);
    order.sharpness.push_back(found == record_of.end() ? 0.0 : found->second->sharpness);
  }
  return order;
}

std::vector<std::string> names_of(const Pictures& pictures) {
  std::vector<std::string> names;
  for (const FrameId& id : pictures.ids) names.push_back(frame_name(id.pass, id.index));
  return names;
}

// A calibration holds for pictures of its own size only.
bool is_calibrated(const Pictures& pictures, const std::optional<Camera>& camera) {
  return camera && std::all_of(pictures.features.begin(), pictures.features.end(), [&](const Features& f) {
           return f.width == camera->width && f.height == camera->height;
         });
}

ColmapModel model_of(const Scene& scene, const Pictures& pictures) {
  ColmapModel model;
  for (std::size_t c = 0; c < scene.cameras.size(); ++c) model.cameras[static_cast<int>(c) + 1] = scene.cameras[c];
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    const View& view = scene.views[v];
    if (!view.registered) continue;
    ModelImage& image = model.images[static_cast<int>(v) + 1];
    image.name = frame_name(pictures.ids[v].pass, pictures.ids[v].index);
    image.camera_id = view.camera + 1;
    image.cam_from_world = view.cam_from_world;
    for (const Eigen::Vector2d& keypoint : view.keypoints) image.observations.push_back({keypoint, -1});
  }
  for (std::size_t t = 0; t < scene.tracks.size(); ++t) {
    const Track& track = scene.tracks[t];
    if (!track.triangulated) continue;
    const auto id = static_cast<std::int64_t>(t) + 1;
    ModelPoint point;
    point.position = track.point;
    std::array<double, 3> colour{};
    for (const Observation& o : track.observations) {
      if (!o.used) continue;
      const auto view = static_cast<std::size_t>(o.view), keypoint = static_cast<std::size_t>(o.keypoint);
      point.error += reprojection_error(scene, o, track.point);
      for (std::size_t i = 0; i < 3; ++i) colour[i] += pictures.features[view].colours[keypoint][i];
      point.track.emplace_back(o.view + 1, o.keypoint);
      model.images.at(o.view + 1).observations[keypoint].point_id = id;
    }
    const auto count = static_cast<double>(point.track.size());
    point.error /= count;
    for (std::size_t i = 0; i < 3; ++i) point.rgb[i] = static_cast<std::uint8_t>(std::lround(colour[i] / count));
    model.points[id] = std::move(point);
  }
  return model;
}

// Of the pictures' longer side, as the EXIF data of a pass says (the film's diagonal stands for the picture's).
std::optional<double> focal_guess(const Scan& scan) {
  const double film_diagonal = std::hypot(36.0, 24.0);
  for (const ScanPass& pass : scan.passes) {
    if (!pass.focal_35mm || pass.width <= 0 || pass.height <= 0) continue;
    return *pass.focal_35mm / film_diagonal * std::hypot(pass.width, pass.height) / std::max(pass.width, pass.height);
  }
  return std::nullopt;
}

json to_json(std::span<const JoinedPass> joined, const Pictures& pictures) {
  json passes = json::array();
  for (const JoinedPass& pass : joined)
    passes.push_back({{"pass", pictures.passes[static_cast<std::size_t>(pass.pass)]},
                      {"views", pass.views},
                      {"residual_mm", 1000 * pass.residual},
                      {"overlap", pass.overlap}});
  return passes;
}

// What the options and the scan say; the board is still to be found.
Result<KnownLengths> lengths_of(const StageContext& context, const Scan& scan) {
  KnownLengths known;
  const double height = context.options.value("height_mm", 0.0);
  const double radius = context.options.value("turntable_radius_mm", 0.0);
  if (height < 0) return wrong_use("height_mm must not be negative", std::to_string(height));
  if (radius < 0) return wrong_use("turntable_radius_mm must not be negative", std::to_string(radius));
  const double given = height > 0 ? height : scan.height_mm.value_or(0.0);
  known.stature_assumed = given <= 0;
  known.stature = (known.stature_assumed ? assumed_height_mm : given) / 1000;
  known.turntable_radius = radius / 1000;
  return known;
}

std::optional<PlacedBoard> board_of(const Scene& scene, const Pictures& pictures) {
  const auto seen =
      std::count_if(pictures.boards.begin(), pictures.boards.end(), [](const auto& b) { return !b.empty(); });
  if (seen == 0) return std::nullopt;
  const std::optional<PlacedBoard> board = place_board(scene, pictures.boards);
  if (!board)
    spdlog::warn(
        "the board is seen in {} pictures, but not well enough for the scale: lay it flat where the camera "
        "sees it from many sides",
        seen);
  return board;
}

json ring_of(const Scene& scene) {
  constexpr double degrees = 180 / std::numbers::pi;
  const Ring ring = find_ring(scene);
  if (!ring.closed)
    spdlog::warn("the cameras do not stand all around the subject: {:.0f} of 360 degrees", degrees * ring.covered);
  return {{"closed", ring.closed},
          {"covered_deg", degrees * ring.covered},
          {"largest_gap_deg", degrees * ring.largest_gap}};
}

Result<json> run(const StageContext& context) {
  const Result<Scan> scan = read_scan(context.bundle);
  if (!scan) return tl::unexpected<Error>(scan.error());
  Result<KnownLengths> known = lengths_of(context, *scan);
  if (!known) return tl::unexpected<Error>(known.error());
  FeatureOptions feature_options;
  feature_options.max_features = context.options.value("max_features", feature_options.max_features);
  Result<Pictures> pictures = read_pictures(context, feature_options, part_of(context.progress, 0, features_end));
  if (!pictures) return tl::unexpected<Error>(pictures.error());
  if (const Result<void> fine = check(*pictures); !fine) return tl::unexpected<Error>(fine.error());
  if (const Result<void> done =
          drop_background(*pictures, context, feature_options, part_of(context.progress, features_end, background_end));
      !done)
    return tl::unexpected<Error>(done.error());

  CorrespondenceOptions correspondence;
  correspondence.threads = context.threads;
  const CaptureOrder order = order_of(context.bundle, *scan, *pictures);
  std::vector<ViewPair> pairs = find_correspondences(pictures->features, order, pictures->background, correspondence,
                                                     part_of(context.progress, background_end, matching_end));
  const std::size_t pair_count = pairs.size();
  ReconstructionOptions options;
  options.threads = context.threads;
  options.known_lens = is_calibrated(*pictures, scan->camera);
  options.known_guess = focal_guess(*scan);
  Scene scene = scene_of(*pictures, options.known_lens ? scan->camera : std::nullopt);
  Result<ReconstructionSummary> summary =
      reconstruct(scene, pairs, options, part_of(context.progress, matching_end, reconstruction_end));
  if (!summary) return tl::unexpected<Error>(summary.error());
  const std::vector<JoinedPass> joined = join_passes(scene, pairs, *known, options);
  summary->registered = scene.registered_count();
  const auto grey_picture = [&](int v) {
    const FrameId& id = pictures->ids[static_cast<std::size_t>(v)];
    const Result<cv::Mat> picture = read_upright(context.bundle.frame(id.pass, id.index));
    cv::Mat grey;
    if (picture) cv::cvtColor(*picture, grey, cv::COLOR_BGR2GRAY);
    return grey;
  };
  if (order.ordered) summary->registered += static_cast<int>(place_between_neighbours(scene, grey_picture).size());
  const std::size_t total = pictures->ids.size();
  const std::string share = std::to_string(summary->registered) + " of " + std::to_string(total);
  if (summary->registered < min_registered_share * static_cast<double>(total))
    return fail("only " + share + " pictures fit together to one scene", "",
                "the subject and the room must stay as they are while the camera walks around: record again, slower "
                "and with more overlap");
  if (summary->registered < wanted_registered_share * static_cast<double>(total))
    spdlog::warn("only {} pictures have found their camera", share);

  context.progress(reconstruction_end, "finding floor and scale");
  known->board = board_of(scene, *pictures);
  const Result<WorldFrame> world = find_world(scene, *known);
  if (!world) return tl::unexpected<Error>(world.error());
  if (world->scale_source == ScaleSource::assumed_height)
    spdlog::warn("the subject's height is not given: {:.0f} mm is assumed and all lengths depend on it",
                 assumed_height_mm);
  move_world(scene, world->world_from_model);
  const json ring = ring_of(scene);
  const auto corner = [](const Eigen::Vector3d& v) { return json::array({v.x(), v.y(), v.z()}); };
  const std::vector<Motion>& motions = pictures->background.motion;
  const std::string motion =
      std::find(motions.begin(), motions.end(), Motion::turn) == motions.end() ? "orbit" : "turn";
  const json scene_file = {{"scale_source", name_of(world->scale_source)},
                           {"scale_uncertainty", world->scale_uncertainty},
                           {"height_mm", 1000 * world->height},
                           {"height_uncertainty_mm", 1000 * world->height * world->height_uncertainty},
                           {"board_views", known->board ? known->board->views : 0},
                           {"motion", motion},
                           {"registered", summary->registered},
                           {"total", total},
                           {"joined_by_shape", to_json(joined, *pictures)},
                           {"floor_seen", world->has_floor},
                           {"ring_radius_m", world->ring_radius},
                           {"ring", ring},
                           {"box", {{"min", corner(world->box.min())}, {"max", corner(world->box.max())}}}};
  const ColmapModel model = model_of(scene, *pictures);
  if (const auto written = write_colmap_model(model, context.out); !written)
    return tl::unexpected<Error>(written.error());
  if (const auto written = write_file(context.out / "scene.json", scene_file.dump(2)); !written)
    return tl::unexpected<Error>(written.error());
  // Of a turn nothing is known but the subject, which has nothing to sway against.
  const std::vector<ViewSway> sway = motion == "turn" ? std::vector<ViewSway>() : estimate_sway(scene, world->box);
  if (const auto written = write_file(context.out / "sway.json", to_json(sway, names_of(*pictures)).dump(2)); !written)
    return tl::unexpected<Error>(written.error());
  return json{{"motion", motion},
              {"registered", summary->registered},
              {"total", total},
              {"joined_by_shape", to_json(joined, *pictures)},
              {"sway_mm", 1000 * median_sway(sway)},
              {"ring", ring},
              {"pairs", pair_count},
              {"rejected_pairs", summary->removed_pairs},
              {"points", model.points.size()},
              {"rms_px", summary->rms_error},
              {"focal_px", scene.cameras.front().fx},
              {"calibrated", options.known_lens}};
}

}  // namespace

Stage cameras_stage() {
  Stage stage;
  stage.name = "cameras";
  stage.version = 6;
  stage.inputs = {"scan.json", "frames"};
  stage.options = {{"height_mm", 0.0}, {"turntable_radius_mm", 0.0}, {"max_features", FeatureOptions{}.max_features}};
  stage.estimate = {
      .memory_gib = 0.25, .memory_gib_per_keyframe = 0.004, .core_seconds = 20, .core_seconds_per_keyframe = 2};
  stage.run = run;
  return stage;
}

}  // namespace gyre
