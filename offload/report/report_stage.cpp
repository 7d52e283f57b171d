// SPDX-License-Identifier: Apache-2.0
#include "offload/report/report_stage.h"

#include "common/bundle/atomic_file.h"
#include "common/mesh/mesh_io.h"
#include "common/parallel/parallel.h"
#include "offload/body/template.h"
#include "offload/report/json_fields.h"
#include "offload/report/pictures.h"
#include "offload/report/report_facts.h"
#include "offload/report/report_page.h"

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

// The fitted body in rest pose, with the texture when template and fit belong together.
std::array<std::string, 4> avatar_pictures(const StageContext& context, const ReportFacts& facts) {
  auto mesh = read_ply(context.bundle.work("fit") / "rest.ply");
  if (!mesh) return {};
  cv::Mat texture = read_picture(context.bundle.work("texture") / "albedo.png");
  if (!texture.empty()) {
    const auto body = find_template(context.options.value("template", std::string()));
    const std::string checksum = text_at(facts.fit, "/template/checksum");
    if (body && body->checksum == checksum && body->mesh.vertices.size() == mesh->vertices.size()) {
      mesh->triangles = body->mesh.triangles;
      mesh->uv = body->mesh.uv;
      mesh->uv_triangles = body->mesh.uv_triangles;
    } else {
      texture = cv::Mat();
    }
  }
  std::array<std::string, 4> uris;
  const std::array<cv::Mat, 4> pictures = render_turnaround(*mesh, texture, 300, 440);
  for (std::size_t i = 0; i < uris.size(); ++i) uris[i] = data_uri(pictures[i], 90);
  return uris;
}

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
    pictures.avatar = avatar_pictures(context, *facts);
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
  stage.inputs = {"scan.json",      "frames.jsonl", "frames",       "work/cameras", "work/cloud",
                  "work/landmarks", "work/fit",     "work/texture", "work/avatar"};
  stage.external = {"template"};
  stage.options = {{"template", ""}};
  stage.published = {"report.json", "report.html"};
  stage.run = run_report;
  return stage;
}

}  // namespace gyre
