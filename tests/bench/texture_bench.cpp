// SPDX-License-Identifier: Apache-2.0
// Measures texturing alone: true cameras and true surface in, the photographs against re-rendered views out.
//
//   texture_bench BUNDLE SUBJECT_DIR [SIZE [OUT_DIR [CASE...]]]   (BUNDLE from truth_bundle; SUBJECT_DIR holds
//   orbit-body/) texture_bench BUNDLE SUBJECT_DIR growth             time and memory from 1024 to 8192 texels
//
// Cases: best_view, without cut and blend; cut_and_blend; unplaced, with the photographs where they are said to be;
// unaligned, without shifts within photographs; sway, with a subject that sways by 4 mm and an exposure that drifts by
// 5 %; magenta, with the background painted. Sway is judged by the photographs without any (sway), by those given from
// where they are said to be (sway_as_given: the renderings are misplaced as the subject was), and by those given from
// where the bake has found them (sway_placed: renderings of the subject where it stood). The equalised errors leave the
// drift out.
#include "common/bundle/atomic_file.h"
#include "common/bundle/bundle.h"
#include "common/geometry/colmap_model.h"
#include "common/log/log.h"
#include "common/mesh/mesh_io.h"
#include "common/metrics/process_usage.h"
#include "common/parallel/parallel.h"
#include "common/render/rasterise.h"
#include "offload/report/texture_errors.h"
#include "offload/report/view_errors.h"
#include "offload/texture/atlas.h"
#include "offload/texture/bake.h"

#include <sys/resource.h>
#include <chrono>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>

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
  double squared_lab = 0, squared_lab_equalised = 0;
  std::size_t pixels = 0;
  double sharpness_photo = 0, sharpness_render = 0;
  gyre::PictureSimilarity similarity;
};

// Inside the silhouette; the photograph in its own exposure and in the common one (its tone).
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
      const Eigen::Vector3f photo_colour(b[0], b[1], b[2]);
      const Eigen::Vector3f rendered_lab = gyre::lab_from_bgr(Eigen::Vector3f(a[0], a[1], a[2]));
      const auto squared = [&](const Eigen::Vector3f& colour) {
        return double{(rendered_lab - gyre::lab_from_bgr(colour)).squaredNorm()};
      };
      error.squared_lab += squared(photo_colour);
      error.squared_lab_equalised += squared(photo.tone.apply(photo_colour));
      ++error.pixels;
    }
  }
  error.sharpness_photo = gyre::sharpness(photo.image, inside);
  error.sharpness_render = gyre::sharpness(rendered, inside);
  error.similarity = gyre::picture_similarity(photo.image, rendered, inside);
  return error;
}

void report(const std::string& name, const gyre::TriangleMesh& mesh, const gyre::BakedTexture& baked,
            std::vector<gyre::Photo> photos, const std::vector<double>& true_gains) {
  double sum = 0, sum_equalised = 0, photo_sharpness = 0, render_sharpness = 0, psnr = 0, ssim = 0;
  std::vector<ViewError> errors(photos.size());
  gyre::parallel_for(photos.size(), 0, [&](std::size_t p) {
    photos[p].tone = gyre::ToneCurve(baked.gains[p]);
    errors[p] = compare(mesh, baked.albedo, photos[p]);
  });
  for (const ViewError& error : errors) {
    const auto rmse = [&](double squared) { return std::sqrt(squared / static_cast<double>(error.pixels)); };
    sum += rmse(error.squared_lab);
    sum_equalised += rmse(error.squared_lab_equalised);
    photo_sharpness += error.sharpness_photo;
    render_sharpness += error.sharpness_render;
    psnr += error.similarity.psnr;
    ssim += error.similarity.ssim;
  }
  const auto views = static_cast<double>(photos.size());
  print(name, "lab_rmse", sum / views, "CIELAB");
  print(name, "lab_rmse_equalised", sum_equalised / views, "CIELAB");
  print(name, "psnr", psnr / views, "dB");
  print(name, "ssim", ssim / views, "1");
  print(name, "sharpness_ratio", render_sharpness / photo_sharpness, "1");
  const gyre::SeamEnergy seams = gyre::seam_energy(baked.albedo, baked.view, mesh);
  print(name, "seam_border", seams.border, "levels");
  print(name, "seam_interior", seams.interior, "levels");
  print(name, "seam_ratio", seams.ratio(), "1");
  print(name, "seam_excess", seams.border - seams.interior, "levels");
  print(name, "seam_charts", seams.charts, "levels");
  Eigen::ArrayXd log_error(photos.size());
  for (std::size_t p = 0; p < photos.size(); ++p) log_error[p] = std::log(baked.gains[p].mean() * true_gains[p]);
  print(name, "gain_error_rms", 100.0 * std::sqrt((log_error - log_error.mean()).square().mean()), "%");
  double surface = 0;
  for (const std::size_t n : baked.origins) surface += static_cast<double>(n);
  const char* const origin_names[] = {"none", "loose", "strict", "filled", "generated", "mirrored"};
  for (std::size_t k = 0; k < baked.origins.size(); ++k) {
    print(name, (std::string("texels_") + origin_names[k]).c_str(),
          100.0 * static_cast<double>(baked.origins[k]) / surface, "%");
  }
}

// How far the placed cameras see the middle of the subject from where the true ones see it, across the view,
// millimetres, root mean square. What all share is no fault: the texture moves along.
void report_places(const std::string& name, const gyre::TriangleMesh& mesh, const gyre::BakedTexture& baked,
                   const std::vector<gyre::Photo>& photos) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& v : mesh.vertices) middle += v / static_cast<double>(mesh.vertices.size());
  double sum = 0;
  for (std::size_t p = 0; p < photos.size(); ++p) {
    const Eigen::Vector3d off = baked.cam_from_world[p] * middle - photos[p].cam_from_world * middle;
    sum += off.head<2>().squaredNorm();
  }
  print(name, "place_error_rms", 1000 * std::sqrt(sum / static_cast<double>(photos.size())), "mm");
}

double peak_memory_gib() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / (1024.0 * 1024.0);
}

// Prints the time of every step, of the clock and of all processors, and the memory so far.
std::optional<gyre::BakedTexture> bake(const std::string& name, const gyre::TriangleMesh& mesh,
                                       std::vector<gyre::Photo> photos, const gyre::BakeOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  const double cpu_start = gyre::processor_seconds();
  auto last = start;
  double cpu_last = cpu_start;
  std::string step;
  const auto elapsed = [](auto since) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - since).count();
  };
  const auto print_step = [&] {
    if (step.empty()) return;
    print(name, ("seconds: " + step).c_str(), elapsed(last), "s");
    print(name, ("cpu seconds: " + step).c_str(), gyre::processor_seconds() - cpu_last, "s");
  };
  auto baked = gyre::bake_texture({.mesh = mesh}, std::move(photos), options, 0, [&](double, std::string_view what) {
    print_step();
    step = what;
    last = std::chrono::steady_clock::now();
    cpu_last = gyre::processor_seconds();
  });
  if (!baked) {
    fail_with(baked.error().message());
    return std::nullopt;
  }
  print_step();
  print(name, "seconds", elapsed(start), "s");
  print(name, "cpu_seconds", gyre::processor_seconds() - cpu_start, "s");
  print(name, "peak_memory", peak_memory_gib(), "GiB");
  return std::move(*baked);
}

// The subject sways in a circle of 4 mm, once in 25 photographs, and the exposure drifts by 5 % up and down.
void disturb(std::vector<gyre::Photo>& photos) {
  for (std::size_t p = 0; p < photos.size(); ++p) {
    const double phase = 2 * M_PI * static_cast<double>(p) / 25.0;
    gyre::Pose& pose = photos[p].cam_from_world;
    pose.translation += pose.rotation * Eigen::Vector3d(0.004 * std::cos(phase), 0.0, 0.004 * std::sin(phase));
    const double gain = 1.0 + 0.05 * std::sin(0.37 * phase);
    const gyre::ToneCurve curve(Eigen::Vector3d::Constant(gain));
    for (int y = 0; y < photos[p].image.rows; ++y) {
      for (int x = 0; x < photos[p].image.cols; ++x) {
        cv::Vec3b& c = photos[p].image.at<cv::Vec3b>(y, x);
        const Eigen::Vector3f drifted = curve.apply(Eigen::Vector3f(c[0], c[1], c[2]));
        for (int k = 0; k < 3; ++k) c[k] = cv::saturate_cast<std::uint8_t>(drifted[k]);
      }
    }
  }
}

void paint_background(const gyre::TriangleMesh& mesh, std::vector<gyre::Photo>& photos) {
  for (gyre::Photo& photo : photos) {
    const cv::Mat subject = gyre::silhouette(mesh, photo.camera, photo.cam_from_world);
    photo.image.setTo(cv::Scalar(255, 0, 255), subject == 0);
  }
}

std::size_t count_magenta(const gyre::BakedTexture& baked) {
  std::size_t count = 0;
  for (int y = 0; y < baked.albedo.rows; ++y) {
    for (int x = 0; x < baked.albedo.cols; ++x) {
      const cv::Vec3b& c = baked.albedo.at<cv::Vec3b>(y, x);
      count += c[0] > c[1] + 60 && c[2] > c[1] + 60 ? 1 : 0;
    }
  }
  return count;
}

void write_pictures(const std::string& name, const gyre::TriangleMesh& mesh, const gyre::BakedTexture& baked,
                    const std::vector<gyre::Photo>& photos, const std::filesystem::path& out) {
  std::filesystem::create_directories(out);
  cv::imwrite((out / (name + ".png")).string(), baked.albedo);
  cv::imwrite((out / (name + "-source.png")).string(), baked.source);
  for (const std::size_t p : {std::size_t{0}, photos.size() / 4, photos.size() / 2, photos.size() - 1}) {
    cv::Mat pair;
    cv::hconcat(photos[p].image,
                gyre::render(mesh, baked.albedo, photos[p].camera, photos[p].cam_from_world, {.lit = false}), pair);
    cv::imwrite((out / (name + "-" + photos[p].name + ".png")).string(), pair);
  }
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

  if (argc > 3 && std::string(argv[3]) == "growth") {
    for (const int size : {1024, 2048, 4096, 8192}) {
      gyre::BakeOptions options;
      options.size = size;
      if (!bake("size " + std::to_string(size), *mesh, photos, options)) return 1;
    }
    return 0;
  }
  const std::filesystem::path out = argc > 4 ? argv[4] : "";
  gyre::BakeOptions options;
  if (argc > 3) options.size = std::stoi(argv[3]);
  std::vector<std::string> cases(argv + std::min(argc, 5), argv + argc);
  if (cases.empty())
    cases = {"cut_and_blend", "best_view", "sway", "unplaced_sway", "magenta", "unplaced", "unaligned"};
  for (const std::string& name : cases) {
    options.place = name.find("unplaced") == std::string::npos;
    options.align = name.find("unaligned") == std::string::npos;
    options.cut_and_blend = name != "best_view";
    std::vector<gyre::Photo> given = photos;
    for (gyre::Photo& photo : given) photo.image = photo.image.clone();  // they are painted over
    if (name.find("sway") != std::string::npos) disturb(given);
    if (name == "magenta") paint_background(*mesh, given);
    const auto baked = bake(name, *mesh, given, options);
    if (!baked) return 1;
    print(name, "magenta_texels", static_cast<double>(count_magenta(*baked)), "texels");
    if (name == "magenta") {
      if (!out.empty()) write_pictures(name, *mesh, *baked, given, out);
      continue;
    }
    report(name, *mesh, *baked, photos, true_gains);
    report_places(name, *mesh, *baked, photos);
    if (name.find("sway") != std::string::npos) {
      report(name + "_as_given", *mesh, *baked, given, true_gains);
      for (std::size_t p = 0; p < given.size(); ++p) given[p].cam_from_world = baked->cam_from_world[p];
      report(name + "_placed", *mesh, *baked, given, true_gains);
    }
    if (!out.empty()) write_pictures(name, *mesh, *baked, photos, out);
  }
  return 0;
}
