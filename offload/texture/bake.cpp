// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/bake.h"

#include "common/parallel/parallel.h"
#include "offload/texture/atlas.h"
#include "offload/texture/face_graph.h"
#include "offload/texture/fill.h"
#include "offload/texture/insertion.h"
#include "offload/texture/mirror.h"
#include "offload/texture/paint.h"
#include "offload/texture/single_view.h"
#include "offload/texture/view_effects.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

namespace gyre {

namespace {

std::vector<Eigen::Vector3d> triangle_normals(const TriangleMesh& mesh) {
  std::vector<Eigen::Vector3d> normals;
  normals.reserve(mesh.triangles.size());
  for (const Eigen::Vector3i& t : mesh.triangles) {
    const Eigen::Vector3d& a = mesh.vertices[t[0]];
    normals.push_back((mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a).normalized());
  }
  return normals;
}

// Sharp views, and head views on the head, count more.
void weigh_scores(ObservationTable& table, std::span<const Photo> photos, std::span<const double> sharpness,
                  std::span<const std::uint8_t> head, double head_preference) {
  for (std::size_t t = 0; t + 1 < table.start.size(); ++t) {
    for (Observation& o : table.of(t)) {
      const bool fits = !head.empty() && photos[o.photo].head_pass == (head[t] != 0);
      o.score *= static_cast<float>(sharpness[o.photo] * (fits ? head_preference : 1.0));
    }
  }
}

void generate_colours(const BakeSubject& subject, const Atlas& atlas, int threads, Canvas& canvas) {
  parallel_for(atlas.size, threads, [&](std::size_t y) {
    for (std::size_t i = y * atlas.size; i < (y + 1) * atlas.size; ++i) {
      const int t = atlas.triangle[i];
      if (t < 0 || !subject.generated[t]) continue;
      canvas.colour[i] = subject.generate(t, corner_weights(atlas, i));
      canvas.origin[i] = TexelOrigin::generated;
      canvas.photo[i] = -1;
      canvas.confidence[i] = 0;
    }
  });
}

// What is generated where photographs show the surface around it.
std::vector<std::uint8_t> generated_skin(const BakeSubject& subject, const Atlas& atlas,
                                         std::span<const std::uint8_t> hidden) {
  std::vector<std::uint8_t> skin(atlas.texels(), 0);
  for (std::size_t i = 0; i < skin.size(); ++i) {
    const int t = atlas.triangle[i];
    skin[i] = t >= 0 && subject.generated[t] != 0 && hidden[t] == 0 ? 1 : 0;
  }
  return skin;
}

// Hues by the golden angle: neighbours in order are far apart in colour.
cv::Vec3b colour_of_photo(int photo) {
  const double hue = std::fmod(photo * 0.61803398875, 1.0) * 180.0;
  cv::Mat hsv(1, 1, CV_8UC3, cv::Scalar(hue, photo % 2 == 0 ? 200 : 130, photo % 3 == 0 ? 180 : 235));
  cv::cvtColor(hsv, hsv, cv::COLOR_HSV2BGR);
  return hsv.at<cv::Vec3b>(0, 0);
}

BakedTexture finish(const Canvas& canvas, const Atlas& atlas, std::size_t photos) {
  BakedTexture baked;
  baked.albedo.create(atlas.size, atlas.size, CV_8UC3);
  baked.source = cv::Mat::zeros(atlas.size, atlas.size, CV_8UC3);
  baked.view = cv::Mat::zeros(atlas.size, atlas.size, CV_16U);
  baked.origin = cv::Mat::zeros(atlas.size, atlas.size, CV_8U);
  baked.confidence = cv::Mat::zeros(atlas.size, atlas.size, CV_8U);
  baked.texels_of.assign(photos, 0);
  std::vector<cv::Vec3b> key(photos);
  for (std::size_t p = 0; p < photos; ++p) key[p] = colour_of_photo(static_cast<int>(p));
  for (std::size_t i = 0; i < atlas.texels(); ++i) {
    const int y = static_cast<int>(i / atlas.size);
    const int x = static_cast<int>(i % atlas.size);
    for (int c = 0; c < 3; ++c) {
      baked.albedo.at<cv::Vec3b>(y, x)[c] = cv::saturate_cast<std::uint8_t>(canvas.colour[i][c]);
    }
    if (atlas.triangle[i] < 0) continue;
    baked.origin.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(canvas.origin[i]);
    baked.confidence.at<std::uint8_t>(y, x) = canvas.confidence[i];
    ++baked.origins[static_cast<std::size_t>(canvas.origin[i])];
    cv::Vec3b& source = baked.source.at<cv::Vec3b>(y, x);
    if (canvas.origin[i] == TexelOrigin::filled) source = {60, 60, 60};
    if (canvas.origin[i] == TexelOrigin::mirrored) source = {150, 150, 150};
    if (canvas.origin[i] == TexelOrigin::generated) source = {255, 255, 255};
    if (canvas.photo[i] < 0) continue;
    source = key[canvas.photo[i]];
    baked.view.at<std::uint16_t>(y, x) = static_cast<std::uint16_t>(canvas.photo[i] + 1);
    ++baked.texels_of[canvas.photo[i]];
  }
  return baked;
}

}  // namespace

Result<void> BakeOptions::check() const {
  if (size < 16 || size > 8192) return wrong_use("texture size out of range", std::to_string(size), "give 16 to 8192");
  if (rim < 0 || rim > 16) return wrong_use("texture rim out of range", std::to_string(rim), "give 0 to 16");
  if (limits.loose_cosine <= 0 || limits.strict_cosine < limits.loose_cosine) {
    return wrong_use("view limits out of order", "strict before loose", "give angles below 90 degrees");
  }
  return {};
}

Result<BakedTexture> bake_texture(const BakeSubject& subject, std::vector<Photo> photos, const BakeOptions& options,
                                  int threads, const Progress& progress) {
  if (auto ok = options.check(); !ok) return tl::unexpected(ok.error());
  const TriangleMesh& mesh = subject.mesh;
  if (mesh.triangles.empty() || mesh.uv_triangles.size() != mesh.triangles.size()) {
    return fail("the mesh has no texture coordinates", {}, "give one texture triangle a triangle");
  }
  if (photos.empty()) return fail("no photographs to texture from", {}, "register the cameras first");

  progress(0.0, "where each photograph was taken");
  constexpr int crop_margin = 8;  // pixels
  parallel_for(photos.size(), threads, [&](std::size_t p) { crop_to(photos[p], mesh.vertices, crop_margin); });
  const std::vector<Eigen::Vector3d> normals = triangle_normals(mesh);
  const std::vector<std::uint8_t> skip =
      subject.hidden.empty() ? std::vector<std::uint8_t>(mesh.triangles.size(), 0) : subject.hidden;
  std::vector<Pose> placed;
  if (options.cut_and_blend && options.place) {
    placed = place_views(mesh, normals, skip, photos, options.sight, options.limits, options.placing, threads);
    progress(0.15, "what each photograph sees");
  }
  std::vector<DepthMap> depths(photos.size());
  parallel_for(photos.size(), threads, [&](std::size_t p) {
    depths[p] = map_depth(mesh, photos[p], options.sight);
    if (placed.empty()) return;
    // The motion found is an estimate: what either place takes for background stays out.
    photos[p].cam_from_world = placed[p];
    const DepthMap given = std::exchange(depths[p], map_depth(mesh, photos[p], options.sight));
    add_edges(depths[p], given);
  });
  const PhotographedSurface surface{mesh, normals, photos, depths, options.sight, options.limits};
  ObservationTable table = observe(surface, skip, threads);
  if (table.all.empty()) {
    return fail("no photograph sees the surface", {}, "check that cameras and fitted mesh share one world");
  }

  progress(0.35, "exposure and sharpness");
  std::vector<Eigen::Vector3d> gains(photos.size(), Eigen::Vector3d::Ones());
  if (options.equalise_exposure) gains = exposure_gains(table, static_cast<int>(photos.size()));
  for (std::size_t p = 0; p < photos.size(); ++p) photos[p].tone = ToneCurve(gains[p]);
  for (Observation& o : table.all) o.colour = photos[o.photo].tone.apply(o.colour);
  const std::vector<double> sharpness = relative_sharpness(table, photos);
  weigh_scores(table, photos, sharpness, subject.head, options.head_preference);

  if (options.cut_and_blend && options.align) {
    progress(0.4, "alignment");
    align_photos(surface, table, options.alignment, threads, photos);
  }

  progress(0.5, "labelling");
  LabelOptions labels = options.labels;
  if (!options.cut_and_blend) labels.sweeps = 0;
  std::vector<std::vector<Candidate>> candidates = label_candidates(table, labels);
  hold_to_one_view(table, subject.feature, candidates);
  const std::vector<SharedEdge> edges = shared_edges(mesh.triangles);
  const std::vector<int> label = choose_photos(mesh.vertices, edges, candidates, photos, labels);

  progress(0.65, "painting");
  const Atlas atlas = map_atlas(mesh.uv, mesh.uv_triangles, options.size, options.rim);
  const PaintJob job{surface, atlas, label, candidates, sharpness};
  Canvas canvas = paint(job, threads);

  progress(0.75, "blending");
  if (options.cut_and_blend) blend_gradients(job, edges, options.gradients, threads, canvas);
  if (!subject.generated.empty()) {
    if (subject.match) subject.match(atlas, canvas);
    generate_colours(subject, atlas, threads, canvas);
    constexpr double reach = 1.0 / 96.0;  // of the texture's side
    insert_texels(mesh, atlas, edges, generated_skin(subject, atlas, skip), reach * options.size, threads, canvas);
  }

  progress(0.9, "filling");
  if (!subject.mirror.empty()) fill_mirrored(mesh, atlas, edges, subject.mirror, skip, threads, canvas);
  fill_surface(atlas, mesh.triangles, mesh.vertices.size(), skip, canvas);
  fill_background(options.size, canvas);

  BakedTexture baked = finish(canvas, atlas, photos.size());
  baked.gains = gains;
  baked.sharpness = sharpness;
  for (const Photo& photo : photos) baked.cam_from_world.push_back(photo.cam_from_world);
  return baked;
}

}  // namespace gyre
