// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/texture_stage.h"

#include "common/bundle/atomic_file.h"
#include "common/geometry/colmap_model.h"
#include "common/mesh/mesh_io.h"
#include "offload/body/template.h"
#include "offload/texture/bake.h"
#include "offload/texture/hand_paint.h"
#include "offload/texture/inner_parts.h"
#include "offload/texture/normal_map.h"
#include "offload/texture/paint.h"
#include "offload/texture/single_view.h"

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

namespace gyre {

namespace {

Result<std::vector<Photo>> load_photos(const StageContext& context) {
  auto model = read_colmap_model(context.bundle.work("cameras"));
  if (!model) return tl::unexpected(model.error());
  model->remove_images_without_points();
  std::vector<Photo> photos;
  for (const auto& [id, image] : model->images) {
    const std::filesystem::path file = context.bundle.frames() / image.name;
    const auto frame = parse_frame_name(image.name);
    if (!is_safe_name(image.name) || !frame) {
      return fail("the camera model names a picture that is no keyframe", image.name, "run the cameras stage again");
    }
    Photo photo;
    photo.name = image.name;
    photo.camera = model->camera_of(image);
    photo.cam_from_world = image.cam_from_world;
    photo.head_pass = frame->pass == "head";
    photo.image = cv::imread(file.string(), cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
    if (photo.image.empty()) return fail("cannot read keyframe", file.string(), "check the bundle");
    if (photo.image.cols != photo.camera.width || photo.image.rows != photo.camera.height) {
      return fail("keyframe and camera differ in size", file.string(), "run the cameras stage again");
    }
    photos.push_back(std::move(photo));
  }
  std::sort(photos.begin(), photos.end(), [](const Photo& a, const Photo& b) { return a.name < b.name; });
  return photos;
}

std::vector<std::uint8_t> head_triangles(const BodyTemplate& body) {
  std::vector<std::uint8_t> head;
  head.reserve(body.mesh.triangles.size());
  for (const Eigen::Vector3i& t : body.mesh.triangles) {
    const BodyRegion region = body.regions[t[0]];
    head.push_back(region == BodyRegion::head || region == BodyRegion::face || region == BodyRegion::inner ? 1 : 0);
  }
  return head;
}

// PNG or JPEG, as the file's name says.
Result<void> write_picture(const cv::Mat& image, const std::filesystem::path& file) {
  constexpr int jpeg_quality = 95;
  std::vector<std::uint8_t> bytes;
  if (!cv::imencode(file.extension().string(), image, bytes, {cv::IMWRITE_JPEG_QUALITY, jpeg_quality}))
    return fail("cannot encode picture", file.string(), "use a smaller size");
  return write_file(file, std::as_bytes(std::span(bytes)));
}

// How far the subject's middle had moved, against where the photograph was said to be taken, millimetres.
double moved_mm(const Pose& placed, const Pose& given, const Eigen::Vector3d& middle) {
  return 1000 * (placed * middle - given * middle).norm();
}

nlohmann::json describe(const BakedTexture& baked, std::span<const std::string> names, std::span<const Pose> given,
                        const Eigen::Vector3d& middle) {
  const auto count = [&](TexelOrigin o) { return static_cast<double>(baked.origins[static_cast<std::size_t>(o)]); };
  double total = 0;
  for (const std::size_t n : baked.origins) total += static_cast<double>(n);
  nlohmann::json views = nlohmann::json::array();
  for (std::size_t p = 0; p < names.size(); ++p) {
    const Eigen::Vector3d& gain = baked.gains[p];
    views.push_back({{"name", names[p]},
                     {"texels", baked.texels_of[p]},
                     {"gain_rgb", {gain[2], gain[1], gain[0]}},
                     {"moved_mm", moved_mm(baked.cam_from_world[p], given[p], middle)},
                     {"sharpness", baked.sharpness[p]}});
  }
  return {{"size", baked.albedo.rows},
          {"surface_texels", total},
          {"share",
           {{"within_45_deg", count(TexelOrigin::strict) / total},
            {"within_75_deg_or_near_edge", count(TexelOrigin::loose) / total},
            {"mirrored", count(TexelOrigin::mirrored) / total},
            {"filled", count(TexelOrigin::filled) / total},
            {"generated", count(TexelOrigin::generated) / total}}},
          {"origins",  // the values of origin.png
           {{"within_45_deg", TexelOrigin::strict},
            {"within_75_deg_or_near_edge", TexelOrigin::loose},
            {"mirrored", TexelOrigin::mirrored},
            {"filled", TexelOrigin::filled},
            {"generated", TexelOrigin::generated}}},
          {"views", views}};
}

Result<nlohmann::json> run(const StageContext& context) {
  BakeOptions options;
  options.size = context.options.value("size", options.size);
  if (options.size < 1024 || options.size > 8192) {
    return wrong_use("texture size out of range", std::to_string(options.size), "give 1024 to 8192");
  }
  const std::string format = context.options.value("format", std::string("png"));
  if (format != "png" && format != "jpeg") return wrong_use("no such picture format", format, "choose png or jpeg");
  const auto body = find_template(context.options.value("template", std::string()));
  if (!body) return tl::unexpected(body.error());
  const std::filesystem::path fitted = context.bundle.work("fit") / "posed.ply";
  auto posed = read_ply(fitted);
  if (!posed) return tl::unexpected(posed.error());
  if (posed->vertices.size() != body->mesh.vertices.size()) {
    return fail("the fitted mesh does not belong to this template", fitted.string(), "run the fit stage again");
  }
  context.progress(0.0, "reading keyframes");
  auto photos = load_photos(context);
  if (!photos) return tl::unexpected(photos.error());

  InnerPaint paint(*body);
  const auto eyes = measure_eyes(*body, posed->vertices, *photos, context.threads);
  if (eyes) paint.match(*eyes);
  BakeSubject subject;
  subject.mesh = body->mesh;
  subject.mesh.vertices = std::move(posed->vertices);
  subject.head = head_triangles(*body);
  subject.feature = face_features(*body);
  subject.mirror = body->mirror;
  HandPaint hands(*body);
  std::string hands_matched;
  subject.hidden = paint.covered();
  subject.generated = paint.covered();
  for (std::size_t t = 0; t < subject.generated.size(); ++t) subject.generated[t] |= hands.covered()[t];
  subject.match = [&](const Atlas& atlas, const Canvas& canvas) { hands_matched = hands.match(atlas, canvas); };
  subject.generate = [&](int t, const Eigen::Vector3d& w) {
    return hands.covered()[t] != 0 ? hands.colour(t, w) : paint.colour(t, w);
  };

  std::vector<std::string> names;
  std::vector<Pose> given;
  for (const Photo& photo : *photos) {
    names.push_back(photo.name);
    given.push_back(photo.cam_from_world);
  }
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& v : subject.mesh.vertices)
    middle += v / static_cast<double>(subject.mesh.vertices.size());
  const auto baked = bake_texture(subject, std::move(*photos), options, context.threads, context.progress);
  if (!baked) return tl::unexpected(baked.error());
  context.progress(0.95, "writing");
  const std::pair<const char*, const cv::Mat*> pictures[] = {
      {format == "png" ? "albedo.png" : "albedo.jpg", &baked->albedo},
      {"source.png", &baked->source},
      {"view.png", &baked->view},
      {"origin.png", &baked->origin},
      {"confidence.png", &baked->confidence}};
  for (const auto& [name, picture] : pictures) {
    if (auto ok = write_picture(*picture, context.out / name); !ok) return tl::unexpected(ok.error());
  }
  nlohmann::json facts = describe(*baked, names, given, middle);
  if (context.options.value("normal_map", false)) {
    const auto cloud = read_cloud(context.bundle.work("cloud") / "cloud.ply");
    if (!cloud) return tl::unexpected(cloud.error());
    const NormalMap relief = bake_normal_map(subject.mesh, *cloud, subject.hidden, {}, context.threads);
    if (auto ok = write_picture(relief.picture, context.out / "normal.png"); !ok) return tl::unexpected(ok.error());
    facts["normal_map"] = {{"size", relief.picture.rows}, {"share_with_cloud", relief.covered}};
  }
  const auto matched = [](bool to_photographs) { return to_photographs ? "matched to the photographs" : "neutral"; };
  facts["generated"] = {
      {"iris", matched(eyes.has_value())},
      {"white_of_the_eyes", matched(eyes && eyes->sclera)},
      {"teeth_and_mouth", eyes && eyes->sclera ? "neutral, in the light of the eyes" : "neutral"},
      {"hands", hands_matched.empty() ? "neutral" : "matched to the photographs of the " + hands_matched}};
  const auto& hand_triangles = hands.covered();
  if (std::all_of(hand_triangles.begin(), hand_triangles.end(), [](std::uint8_t c) { return c == 0; }))
    facts["generated"].erase("hands");
  if (auto ok = write_file(context.out / "texture.json", facts.dump(1) + "\n"); !ok) return tl::unexpected(ok.error());
  context.progress(1.0, "done");
  return nlohmann::json{{"size", facts["size"]}, {"share", facts["share"]}, {"views", names.size()}};
}

}  // namespace

Stage texture_stage() {
  Stage stage;
  stage.name = "texture";
  stage.version = 2;
  stage.inputs = {"frames", "work/cameras", "work/cloud/cloud.ply", "work/fit"};
  stage.external = {"template"};
  stage.options = {{"template", ""}, {"size", BakeOptions{}.size}, {"format", "png"}, {"normal_map", false}};
  stage.estimate = {
      .memory_gib = 1.2, .memory_gib_per_keyframe = 0.006, .core_seconds = 60, .core_seconds_per_keyframe = 1};
  stage.run = run;
  return stage;
}

}  // namespace gyre
