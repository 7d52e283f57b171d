// SPDX-License-Identifier: Apache-2.0
// Measures texturing alone: true cameras and true surface in, the photographs against re-rendered views out.
//
//   texture_bench BUNDLE SUBJECT_DIR [SIZE [OUT_DIR]]   (BUNDLE from truth_bundle; SUBJECT_DIR holds orbit-body/)
#include "common/bundle/atomic_file.h"
#include "common/bundle/bundle.h"
#include "common/geometry/colmap_model.h"
#include "common/log/log.h"
#include "common/mesh/mesh_io.h"
#include "common/render/rasterise.h"
#include "offload/texture/atlas.h"
#include "offload/texture/bake.h"

#include <sys/resource.h>
#include <chrono>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace {

using nlohmann::json;

void print(const std::string& name, const char* metric, double value, const char* unit) {
  std::printf(
      "%s\n",
      json{{"bench", "texture"}, {"case", name}, {"metric", metric}, {"value", value}, {"unit", unit}}.dump().c_str());
}

int fail_with(const std::string& text) {
  std::fprintf(stderr, "texture_bench: %s\n", text.c_str());
  return 1;
}

int root_of(std::vector<int>& parent, int i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

// The subject's own texture lets charts share texels (both shoes, front and back of the jeans), which light from one
// side tells apart. Puts every chart that would cover texels of an earlier one into a further layer and lays the layers
// out in a square grid.
void separate_charts(gyre::TriangleMesh& mesh) {
  std::vector<int> parent(mesh.uv.size());
  std::iota(parent.begin(), parent.end(), 0);
  for (const Eigen::Vector3i& t : mesh.uv_triangles) {
    for (int k = 1; k < 3; ++k) parent[root_of(parent, t[k])] = root_of(parent, t[0]);
  }
  std::map<int, std::vector<Eigen::Vector3i>> charts;
  for (const Eigen::Vector3i& t : mesh.uv_triangles) charts[root_of(parent, t[0])].push_back(t);
  constexpr int grid = 512;
  std::vector<std::vector<bool>> layers;
  std::map<int, std::size_t> layer_of;
  for (const auto& [root, triangles] : charts) {
    const gyre::Atlas own = gyre::map_atlas(mesh.uv, triangles, grid, 0);
    const auto free_in = [&](const std::vector<bool>& taken) {
      std::size_t clash = 0, covered = 0;
      for (std::size_t i = 0; i < own.texels(); ++i) {
        covered += own.triangle[i] >= 0;
        clash += own.triangle[i] >= 0 && taken[i];
      }
      return clash <= covered / 50;
    };
    std::size_t layer = 0;
    while (layer < layers.size() && !free_in(layers[layer])) ++layer;
    if (layer == layers.size()) layers.emplace_back(own.texels(), false);
    for (std::size_t i = 0; i < own.texels(); ++i) {
      if (own.triangle[i] >= 0) layers[layer][i] = true;
    }
    layer_of[root] = layer;
  }
  const auto side = static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(layers.size()))));
  for (std::size_t i = 0; i < mesh.uv.size(); ++i) {
    const std::size_t layer = layer_of[root_of(parent, static_cast<int>(i))];
    const Eigen::Vector2d corner(static_cast<double>(layer % side), static_cast<double>(layer / side));
    mesh.uv[i] = (mesh.uv[i] + corner) / static_cast<double>(side);
  }
}

struct ViewError {
  double squared_lab = 0;
  std::size_t pixels = 0;
  double sharpness_photo = 0, sharpness_render = 0;
};

// Inside the silhouette; the photograph in its own exposure (gain 1) or in the common one.
ViewError compare(const gyre::TriangleMesh& mesh, const cv::Mat& albedo, const gyre::Photo& photo) {
  cv::Mat rendered = gyre::render(mesh, albedo, photo.camera, photo.cam_from_world, {.lit = false});
  const gyre::VisibilityBuffer seen =
      gyre::rasterise(mesh.vertices, mesh.triangles, photo.camera, photo.cam_from_world);
  cv::Mat inside(photo.image.size(), CV_8U);
  for (int y = 0; y < inside.rows; ++y) {
    for (int x = 0; x < inside.cols; ++x) inside.at<std::uint8_t>(y, x) = seen.triangle[seen.index(x, y)] >= 0 ? 1 : 0;
  }
  ViewError error;
  for (int y = 0; y < inside.rows; ++y) {
    for (int x = 0; x < inside.cols; ++x) {
      if (!inside.at<std::uint8_t>(y, x)) continue;
      const cv::Vec3b& a = rendered.at<cv::Vec3b>(y, x);
      const cv::Vec3b& b = photo.image.at<cv::Vec3b>(y, x);
      const Eigen::Vector3f photo_colour = photo.tone.apply(Eigen::Vector3f(b[0], b[1], b[2]));
      error.squared_lab += (gyre::lab_from_bgr(Eigen::Vector3f(a[0], a[1], a[2])) - gyre::lab_from_bgr(photo_colour))
                               .cast<double>()
                               .squaredNorm();
      ++error.pixels;
    }
  }
  cv::Mat core;
  cv::erode(inside, core, cv::Mat::ones(13, 13, CV_8U));
  const auto sharpness = [&](const cv::Mat& image) {
    cv::Mat grey, laplacian;
    cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
    cv::GaussianBlur(grey, grey, {0, 0}, 0.8);  // sensor noise is no sharpness
    cv::Laplacian(grey, laplacian, CV_32F);
    return cv::sum(cv::abs(laplacian).mul(cv::Mat_<float>(core)))[0];
  };
  error.sharpness_photo = sharpness(photo.image);
  error.sharpness_render = sharpness(rendered);
  return error;
}

void report(const std::string& name, const gyre::TriangleMesh& mesh, const gyre::BakedTexture& baked,
            std::vector<gyre::Photo> photos, const std::vector<double>& true_gains) {
  double sum = 0, sum_equalised = 0, photo_sharpness = 0, render_sharpness = 0;
  for (std::size_t p = 0; p < photos.size(); ++p) {
    const ViewError raw = compare(mesh, baked.albedo, photos[p]);
    photos[p].tone = gyre::ToneCurve(baked.gains[p]);
    const ViewError equalised = compare(mesh, baked.albedo, photos[p]);
    sum += std::sqrt(raw.squared_lab / static_cast<double>(raw.pixels));
    sum_equalised += std::sqrt(equalised.squared_lab / static_cast<double>(equalised.pixels));
    photo_sharpness += raw.sharpness_photo;
    render_sharpness += raw.sharpness_render;
  }
  const auto views = static_cast<double>(photos.size());
  print(name, "lab_rmse", sum / views, "CIELAB");
  print(name, "lab_rmse_equalised", sum_equalised / views, "CIELAB");
  print(name, "sharpness_ratio", render_sharpness / photo_sharpness, "1");
  Eigen::ArrayXd log_error(photos.size());
  for (std::size_t p = 0; p < photos.size(); ++p) log_error[p] = std::log(baked.gains[p].mean() * true_gains[p]);
  print(name, "gain_error_rms", 100.0 * std::sqrt((log_error - log_error.mean()).square().mean()), "%");
  double surface = 0;
  for (const std::size_t n : baked.origins) surface += static_cast<double>(n);
  const char* const origin_names[] = {"none", "loose", "strict", "filled", "generated"};
  for (std::size_t k = 0; k < baked.origins.size(); ++k) {
    print(name, (std::string("texels_") + origin_names[k]).c_str(),
          100.0 * static_cast<double>(baked.origins[k]) / surface, "%");
  }
}

double peak_memory_gib() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / (1024.0 * 1024.0);
}

}  // namespace

int main(int argc, char** argv) {
  gyre::start_logging("texture_bench", "warn");
  if (argc < 3) return fail_with("usage: texture_bench BUNDLE SUBJECT_DIR [SIZE [OUT_DIR]]");
  const gyre::Bundle bundle(argv[1]);
  const std::filesystem::path subject_folder = argv[2];
  const auto model = gyre::read_colmap_model(bundle.work("cameras"));
  if (!model) return fail_with(model.error().message());
  auto mesh = gyre::read_obj(subject_folder / "orbit-body" / "mesh.obj");
  if (!mesh) return fail_with(mesh.error().message());
  separate_charts(*mesh);

  std::map<std::string, json> truth;
  std::vector<gyre::Photo> photos;
  std::vector<double> true_gains;
  for (const auto& [id, image] : model->images) {
    const auto frame = gyre::parse_frame_name(image.name);
    if (!frame) return fail_with("not a keyframe: " + image.name);
    if (!truth.contains(frame->pass)) {
      const auto text = gyre::read_file(subject_folder / ("orbit-" + frame->pass) / "truth.json");
      if (!text) return fail_with(text.error().message());
      truth[frame->pass] = json::parse(*text).at("frames");
    }
    gyre::Photo photo;
    photo.name = image.name;
    photo.camera = model->camera_of(image);
    photo.cam_from_world = image.cam_from_world;
    photo.head_pass = frame->pass == "head";
    photo.image = cv::imread((bundle.frames() / image.name).string());
    photos.push_back(photo);
    true_gains.push_back(truth[frame->pass].at(frame->index).at("gain"));
  }

  gyre::BakeOptions options;
  if (argc > 3) options.size = std::stoi(argv[3]);
  gyre::BakeSubject subject{.mesh = *mesh};
  for (const bool best_view : {false, true}) {
    options.cut_and_blend = !best_view;
    const std::string name = best_view ? "best_view" : "cut_and_blend";
    const auto start = std::chrono::steady_clock::now();
    auto last = start;
    std::string step;
    const auto elapsed = [&](auto since) {
      return std::chrono::duration<double>(std::chrono::steady_clock::now() - since).count();
    };
    const auto baked = gyre::bake_texture(subject, photos, options, 0, [&](double, std::string_view what) {
      if (!step.empty()) print(name, ("seconds: " + step).c_str(), elapsed(last), "s");
      step = what;
      last = std::chrono::steady_clock::now();
    });
    if (!baked) return fail_with(baked.error().message());
    print(name, "seconds", elapsed(start), "s");
    print(name, "peak_memory", peak_memory_gib(), "GiB");
    report(name, *mesh, *baked, photos, true_gains);
    if (argc > 4) {
      const std::filesystem::path out = argv[4];
      std::filesystem::create_directories(out);
      cv::imwrite((out / (name + ".png")).string(), baked->albedo);
      cv::imwrite((out / (name + "-source.png")).string(), baked->source);
      for (const std::size_t p : {std::size_t{0}, photos.size() / 4, photos.size() / 2, photos.size() - 1}) {
        cv::Mat pair;
        cv::hconcat(photos[p].image,
                    gyre::render(*mesh, baked->albedo, photos[p].camera, photos[p].cam_from_world, {.lit = false}),
                    pair);
        cv::imwrite((out / (name + "-" + photos[p].name)).string(), pair);
      }
    }
  }
  return 0;
}
