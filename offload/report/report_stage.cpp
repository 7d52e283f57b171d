// SPDX-License-Identifier: Apache-2.0
#include "offload/report/report_stage.h"

#include "common/bundle/atomic_file.h"
#include "common/mesh/mesh_io.h"
#include "common/parallel/parallel.h"
#include "offload/body/template.h"
#include "offload/body/texture_file.h"
#include "offload/report/json_fields.h"
#include "offload/report/overlays.h"
#include "offload/report/pictures.h"
#include "offload/report/report_facts.h"
#include "offload/report/report_page.h"
#include "offload/report/texture_sources.h"

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace gyre {

namespace {

constexpr int thumbnail_height = 160;

// OpenCV reports a damaged file by an empty picture or by throwing; both mean that there is no picture.
cv::Mat read_picture(const std::filesystem::path& file, int mode = cv::IMREAD_COLOR) {
  try {
    return std::filesystem::exists(file) ? cv::imread(file.string(), mode) : cv::Mat();
  } catch (const cv::Exception&) {
    return {};
  }
}

std::vector<std::string> thumbnails(const StageContext& context, const ReportFacts& facts) {
  std::vector<std::string> uris(facts.keyframes.size());
  parallel_for(uris.size(), context.threads, [&](std::size_t i) {
    const FrameId& frame = facts.keyframes[i];
    // The decoder's own reduction by two is enough for thumbnails and four times as fast.
    const cv::Mat photo = read_picture(context.bundle.frame(frame.pass, frame.index), cv::IMREAD_REDUCED_COLOR_2);
    if (photo.empty()) return;
    const double scale = static_cast<double>(thumbnail_height) / photo.rows;
    cv::Mat small;
    cv::resize(photo, small, {std::max(1, static_cast<int>(std::lround(scale * photo.cols))), thumbnail_height}, 0, 0,
               cv::INTER_AREA);
    uris[i] = data_uri(small, 80);
  });
  return uris;
}

std::array<std::string, 4> cloud_pictures(const StageContext& context, const ReportFacts& facts) {
  const auto cloud = read_cloud(context.bundle.work("cloud") / "cloud.ply");
  if (!cloud || cloud->points.empty()) return {};
  std::array<std::string, 4> uris;
  for (std::size_t i = 0; i < uris.size(); ++i)
    uris[i] = data_uri(render_cloud(*cloud, facts.facing() + static_cast<double>(i) * M_PI / 2, 300, 440), 90);
  return uris;
}

template <std::size_t N>
std::array<std::string, N> uris_of(const std::array<cv::Mat, N>& pictures) {
  std::array<std::string, N> uris;
  for (std::size_t i = 0; i < N; ++i) uris[i] = data_uri(pictures[i], 90);
  return uris;
}

// The fitted surface at rest and as it stood, with the texture when template and fit belong together.
class FittedBody {
 public:
  FittedBody(const StageContext& context, const ReportFacts& facts) {
    if (auto mesh = read_ply(context.bundle.work("fit") / "rest.ply")) rest_ = std::move(*mesh);
    if (auto mesh = read_ply(context.bundle.work("fit") / "posed.ply")) posed_ = std::move(*mesh);
    texture_ = read_picture(texture_file(context.bundle, "albedo"));
    if (texture_.empty()) return;
    const auto body = find_template(context.options.value("template", std::string()));
    if (!body || body->checksum != text_at(facts.fit, "/template/checksum")) {
      texture_ = cv::Mat();
      return;
    }
    for (TriangleMesh* mesh : {&rest_, &posed_}) {
      if (body->mesh.vertices.size() != mesh->vertices.size()) continue;
      mesh->triangles = body->mesh.triangles;
      mesh->uv = body->mesh.uv;
      mesh->uv_triangles = body->mesh.uv_triangles;
    }
    if (rest_.uv_triangles.empty() || posed_.uv_triangles.empty()) texture_ = cv::Mat();
  }

  std::array<std::string, 4> turnaround() const {
    if (rest_.vertices.empty()) return {};
    return uris_of(render_turnaround(rest_, texture_, 300, 440));
  }

  // Coloured by what quality.json says.
  std::array<std::string, 4> distances(const Bundle& bundle) const {
    const auto text = read_file(bundle.work("fit") / "quality.json");
    const nlohmann::json quality = text ? nlohmann::json::parse(*text, nullptr, false) : nlohmann::json();
    const nlohmann::json residuals = quality.is_object() ? quality.value("residual_mm", nlohmann::json()) : nullptr;
    if (rest_.vertices.empty() || !residuals.is_array() || residuals.size() != rest_.vertices.size()) return {};
    std::vector<double> distances;
    for (const nlohmann::json& r : residuals)
      distances.push_back(r.is_number() ? r.get<double>() : std::numeric_limits<double>::infinity());
    TriangleMesh coloured = rest_;
    coloured.colours = heat_colours(distances, heat_limit_mm);
    return uris_of(render_turnaround(coloured, cv::Mat(), 300, 440));
  }

  // The surface in the colours of a picture that is as the texture is.
  std::array<std::string, 4> painted(const cv::Mat& picture) const {
    if (texture_.empty() || picture.empty() || rest_.vertices.empty()) return {};
    return uris_of(render_turnaround(rest_, picture, 300, 440));
  }

  // Photographs from four sides of every pass.
  std::vector<OverlayPicture> overlays(const Bundle& bundle, const ReportFacts& facts, int threads) const {
    if (posed_.vertices.empty()) return {};
    std::vector<const ModelImage*> views;
    for (const ScanPass& pass : facts.scan.passes)
      for (const ModelImage* view : spread_views(facts.model, pass.name, facts.facing(), 4)) views.push_back(view);
    std::vector<OverlayPicture> pictures(views.size());
    parallel_for(views.size(), threads, [&](std::size_t i) {
      const Overlay overlay = make_overlay(facts.model, *views[i], bundle.root() / "frames" / views[i]->name, posed_,
                                           texture_, overlay_height);
      if (!overlay.avatar.empty())
        pictures[i] = {views[i]->name, data_uri(overlay.photo, 85), data_uri(overlay.avatar, 85)};
    });
    std::erase_if(pictures, [](const OverlayPicture& p) { return p.avatar.empty(); });
    return pictures;
  }

 private:
  static constexpr int overlay_height = 420;

  TriangleMesh rest_, posed_;
  cv::Mat texture_;
};

Result<nlohmann::json> run_report(const StageContext& context) {
  const auto facts = collect_facts(context.bundle);
  if (!facts) return tl::unexpected(facts.error());
  ReportPictures pictures;
  try {
    context.progress(0.1, "keyframes");
    pictures.keyframes = thumbnails(context, *facts);
    context.progress(0.5, "cloud");
    pictures.cloud = cloud_pictures(context, *facts);
    context.progress(0.7, "avatar");
    const FittedBody body(context, *facts);
    pictures.avatar = body.turnaround();
    pictures.distance = body.distances(context.bundle);
    const std::filesystem::path texture = context.bundle.work("texture");
    pictures.views = body.painted(read_picture(texture / "source.png"));
    pictures.origins =
        body.painted(colour_origins(read_picture(texture / "origin.png", cv::IMREAD_UNCHANGED), facts->texture));
    pictures.overlays = body.overlays(context.bundle, *facts, context.threads);
  } catch (const cv::Exception& error) {
    return fail("cannot make the pictures of the report", context.bundle.root().string(), error.what());
  }
  const nlohmann::json report = to_json(*facts);
  if (auto written = write_file(context.out / "report.json", report.dump(2) + "\n"); !written)
    return tl::unexpected(written.error());
  if (auto written = write_file(context.out / "report.html", report_page(*facts, pictures)); !written)
    return tl::unexpected(written.error());
  context.progress(1.0, "done");
  return nlohmann::json{{"summary", facts->summary}, {"warnings", facts->warnings}};
}

}  // namespace

Stage report_stage() {
  Stage stage;
  stage.name = "report";
  stage.version = 3;
  stage.inputs = {"scan.json",      "frames.jsonl", "frames",       "work/cameras", "work/cloud",
                  "work/landmarks", "work/fit",     "work/texture", "work/avatar"};
  stage.external = {"template"};
  stage.options = {{"template", ""}};
  stage.published = {"report.json", "report.html"};
  stage.estimate = {.parallel = false, .memory_gib = 0.4, .core_seconds = 10, .core_seconds_per_keyframe = 0.05};
  stage.run = run_report;
  return stage;
}

}  // namespace gyre
