// SPDX-License-Identifier: Apache-2.0
#include "offload/report/evaluate.h"

#include "common/bundle/atomic_file.h"
#include "common/geometry/colmap_model.h"
#include "common/mesh/mesh_io.h"
#include "common/render/rasterise.h"
#include "offload/body/template.h"
#include "offload/report/surface_errors.h"
#include "tests/temporary_folder.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

namespace gyre {
namespace {

using nlohmann::json;

constexpr int frame_count = 8;

json array_of(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

// The built-in human as the true subject, seen by a ring of cameras, and a bundle that reconstructed it exactly but in
// a world of its own. The tests spoil one thing each.
class Evaluate : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    suite_folder = new TemporaryFolder;
    template_file = suite_folder->path() / "template.glb";
    const auto written = write_template(built_in_template(), template_file);
    ASSERT_TRUE(written) << written.error().message();
    auto read = read_template(template_file);
    ASSERT_TRUE(read) << read.error().message();
    body = new BodyTemplate(std::move(*read));
  }
  static void TearDownTestSuite() {
    delete body;
    delete suite_folder;
  }

  void SetUp() override {
    camera = Camera::from_fov(120, 200, 0.9);
    camera.k1 = -0.03;
    posed = body->mesh;
    for (int i = 0; i < frame_count; ++i) {
      const double azimuth = 2 * M_PI * i / frame_count;
      poses.push_back(look_at({2.6 * std::sin(azimuth), 1.0 + 0.3 * (i % 3), 2.6 * std::cos(azimuth)}, {0, 0.9, 0}));
    }
    // Few colours near those of the background: JPEG halves the colour resolution, which must not be what is measured.
    texture.create(128, 128, CV_8UC3);
    for (int y = 0; y < texture.rows; ++y)
      for (int x = 0; x < texture.cols; ++x)
        texture.at<cv::Vec3b>(y, x) =
            cv::Vec3b(static_cast<std::uint8_t>(140 + x / 8), static_cast<std::uint8_t>(130 + y / 8), 120);
    const std::vector<Eigen::Vector3d> rest = joint_positions(*body, body->mesh.vertices);
    for (std::size_t j = 0; j < rest.size(); ++j) joints[body->joints[j].name] = rest[j];
    for (const Eigen::Vector3d& p : sample_surface(posed, 20000, 3)) cloud.points.push_back(p.cast<float>());
  }

  std::filesystem::path truth_folder() const { return root / "truth"; }

  // turn: radians the subject turns from frame to frame, before a camera that then follows less far around it.
  void write_truth(const std::string& sequence = "orbit-body", double turn = 0.0) const {
    const std::filesystem::path folder = truth_folder() / sequence;
    std::filesystem::create_directories(folder);
    json true_joints = json::object();
    for (const auto& [mixamo, vrm] : {std::pair("Hips", "hips"),
                                      {"Head", "head"},
                                      {"LeftArm", "leftUpperArm"},
                                      {"RightForeArm", "rightLowerArm"},
                                      {"LeftUpLeg", "leftUpperLeg"},
                                      {"RightFoot", "rightFoot"}})
      true_joints[mixamo] = array_of(joints.at(vrm));
    json frames = json::array();
    for (int i = 0; i < frame_count; ++i) {
      const Pose subject_from_world{Eigen::Quaterniond(Eigen::AngleAxisd(-turn * i, Eigen::Vector3d::UnitY())),
                                    {0, 0, 0}};
      const Eigen::Matrix4d m = (poses[i] * subject_from_world).matrix();
      json rows = json::array();
      for (int r = 0; r < 4; ++r) rows.push_back({m(r, 0), m(r, 1), m(r, 2), m(r, 3)});
      frames.push_back({{"index", 10 * i},
                        {"cam_from_world", rows},
                        {"subject_yaw_deg", turn * i * 180 / M_PI},
                        {"joints", true_joints}});
    }
    const json truth = {{"format", "synth-capture-1"},
                        {"camera",
                         {{"width", camera.width},
                          {"height", camera.height},
                          {"fx", camera.fx},
                          {"fy", camera.fy},
                          {"cx", camera.cx},
                          {"cy", camera.cy},
                          {"k1", camera.k1}}},
                        {"frames", frames}};
    ASSERT_TRUE(write_file(folder / "truth.json", truth.dump()));
    ASSERT_TRUE(write_ply(body->mesh, folder / "mesh.ply"));
  }

  // bundle_from_truth: where the reconstruction put its world.
  Bundle write_bundle(const Similarity& bundle_from_truth) const {
    Scan scan;
    scan.id = "01ARZ3NDEKTSV4RRFFQ69G5FAV";
    scan.passes = {{"body", 15, 100, camera.width, camera.height}};
    const auto bundle = create_bundle(root / "bundle", scan);
    EXPECT_TRUE(bundle) << bundle.error().message();
    for (const char* stage : {"cameras", "cloud", "fit", "texture"})
      std::filesystem::create_directories(bundle->work(stage));
    ShadeOptions unlit;
    unlit.lit = false;
    unlit.background = {120, 138, 148};
    ColmapModel model;
    model.cameras[1] = camera;
    for (int i = 0; i < frame_count; ++i) {
      cv::imwrite(bundle->frame("body", 10 * i).string(), render(body->mesh, texture, camera, poses[i], unlit),
                  {cv::IMWRITE_JPEG_QUALITY, 100});
      ModelImage image;
      image.name = frame_name("body", 10 * i);
      image.cam_from_world = poses[i];
      if (i < registered) model.images[i + 1] = image;
    }
    model.move_world(bundle_from_truth);
    EXPECT_TRUE(write_colmap_model(model, bundle->work("cameras")));
    PointCloud moved = cloud;
    for (Eigen::Vector3f& p : moved.points) p = (bundle_from_truth * p.cast<double>()).cast<float>();
    EXPECT_TRUE(write_cloud(moved, bundle->work("cloud") / "cloud.ply"));
    TriangleMesh fitted = posed;
    for (Eigen::Vector3d& v : fitted.vertices) v = bundle_from_truth * v;
    fitted.normals.clear();
    EXPECT_TRUE(write_ply(fitted, bundle->work("fit") / "posed.ply"));
    json fitted_joints = json::object();
    for (const auto& [name, position] : joints)
      fitted_joints[name] = array_of(bundle_from_truth * (position + joint_offset));
    const json fit = {{"template", {{"name", body->name}, {"checksum", body->checksum}}}, {"joints", fitted_joints}};
    EXPECT_TRUE(write_file(bundle->work("fit") / "fit.json", fit.dump()));
    cv::imwrite((bundle->work("texture") / "albedo.png").string(), texture + texture_offset);
    cv::imwrite((bundle->work("texture") / "view.png").string(), cv::Mat(texture.size(), CV_16U, cv::Scalar(1)));
    return *bundle;
  }

  json figures(const Bundle& bundle) const {
    EvaluateOptions options;
    options.body_template = template_file.string();
    options.surface_samples = 5000;
    const auto answer = evaluate(bundle, truth_folder(), options);
    EXPECT_TRUE(answer) << answer.error().message();
    return answer ? *answer : json();
  }

  static Similarity elsewhere(double scale) {
    return {scale,
            Eigen::Quaterniond(Eigen::AngleAxisd(2.1, Eigen::Vector3d(0.1, 1, -0.2).normalized())),
            {0.7, -0.3, 1.1}};
  }

  static inline BodyTemplate* body = nullptr;
  static inline TemporaryFolder* suite_folder = nullptr;
  static inline std::filesystem::path template_file;
  TemporaryFolder temporary;
  const std::filesystem::path& root = temporary.path();
  Camera camera;
  std::vector<Pose> poses;
  TriangleMesh posed;
  PointCloud cloud;
  cv::Mat texture;
  std::map<std::string, Eigen::Vector3d> joints;
  Eigen::Vector3d joint_offset = Eigen::Vector3d::Zero();
  cv::Scalar texture_offset = cv::Scalar::all(0);
  int registered = frame_count;
};

TEST_F(Evaluate, an_exact_reconstruction_in_another_world_has_no_error) {
  write_truth();
  const json j = figures(write_bundle(elsewhere(1.0)));
  EXPECT_EQ(j["registered"]["share"], 1.0);
  EXPECT_LT(j["cameras"]["centre_mm"]["max"], 1e-6);
  EXPECT_LT(j["cameras"]["rotation_deg"]["max"], 1e-6);
  EXPECT_NEAR(j["cameras"]["scale"], 1.0, 1e-9);
  EXPECT_LT(j["cloud"]["accuracy_mm"]["max"], 1e-2);
  EXPECT_EQ(j["cloud"]["accuracy_mm"]["within_5mm"], 1.0);
  EXPECT_LT(j["cloud"]["completeness_mm"]["median"], 10);
  EXPECT_LT(j["surface"]["rigid"]["true_to_fitted_mm"]["max"], 1e-2);
  EXPECT_LT(j["surface"]["rigid"]["fitted_to_true_mm"]["max"], 1e-2);
  EXPECT_LT(j["surface"]["similarity"]["true_to_fitted_mm"]["p95"], 1e-2);
  EXPECT_LT(j["joints"]["max"], 1e-2);
  EXPECT_EQ(j["joints"]["by_name"].size(), 6u);
  EXPECT_LT(j["views"]["cielab_rmse"], 1.5);  // what JPEG and 8 bits leave
  EXPECT_EQ(j["views"]["views"], frame_count);
  EXPECT_GT(j["views"]["sharpness_ratio"], 0.5);
  EXPECT_EQ(j["views"]["by_view"].size(), static_cast<std::size_t>(frame_count));
  EXPECT_EQ(j["seams"]["border"], 0.0);  // one view
  EXPECT_LT(j["seams"]["interior"], 1.0);
  EXPECT_EQ(j["missing"].size(), 1u) << j["missing"];
  EXPECT_TRUE(j["missing"]["held_out"].is_string());  // the truth has no video
}

TEST_F(Evaluate, a_turn_taken_in_as_body_has_the_truth_of_the_turn) {
  write_truth("turn", 2 * M_PI / frame_count);
  const Bundle bundle = write_bundle(elsewhere(1.0));
  EXPECT_FALSE(evaluate(bundle, truth_folder()));
  ASSERT_TRUE(write_file(bundle.work("cameras") / "scene.json", R"({"motion": "turn"})"));
  const json j = figures(bundle);
  EXPECT_EQ(j["registered"]["share"], 1.0);
  EXPECT_LT(j["cameras"]["centre_mm"]["max"], 1e-6);
  EXPECT_LT(j["cameras"]["rotation_deg"]["max"], 1e-6);
  EXPECT_LT(j["surface"]["rigid"]["true_to_fitted_mm"]["max"], 1e-2);
}

TEST_F(Evaluate, a_wrong_scale_shows_only_where_scale_counts) {
  write_truth();
  const json j = figures(write_bundle(elsewhere(1.04)));
  EXPECT_NEAR(j["cameras"]["scale"], 1 / 1.04, 1e-9);
  EXPECT_LT(j["cameras"]["centre_mm"]["max"], 1e-6);
  EXPECT_GT(j["cameras"]["centre_at_own_scale_mm"]["median"], 50);
  EXPECT_NEAR(j["surface"]["rigid"]["scale"], 1.0, 1e-12);
  EXPECT_GT(j["surface"]["rigid"]["true_to_fitted_mm"]["mean"], 3);
  EXPECT_NEAR(j["surface"]["similarity"]["scale"], 1 / 1.04, 1e-4);
  EXPECT_LT(j["surface"]["similarity"]["true_to_fitted_mm"]["mean"], 0.1);
}

TEST_F(Evaluate, known_errors_come_back_in_their_units) {
  write_truth();
  joint_offset = {0.003, 0.004, 0};
  texture_offset = cv::Scalar(0, 40, 0);
  registered = 6;
  // Every vertex 4 mm out along its normal; every cloud point 7 mm.
  const auto normals = vertex_normals(posed.vertices, posed.triangles);
  for (std::size_t i = 0; i < normals.size(); ++i) posed.vertices[i] += 0.004 * normals[i];
  TriangleMesh shell = body->mesh;
  for (std::size_t i = 0; i < normals.size(); ++i) shell.vertices[i] += 0.007 * normals[i];
  cloud.points.clear();
  for (const Eigen::Vector3d& p : sample_surface(shell, 20000, 3)) cloud.points.push_back(p.cast<float>());
  const json j = figures(write_bundle(elsewhere(1.0)));
  EXPECT_DOUBLE_EQ(j["registered"]["share"], 0.75);
  EXPECT_NEAR(j["surface"]["rigid"]["fitted_to_true_mm"]["median"], 4, 0.4);
  EXPECT_NEAR(j["cloud"]["accuracy_mm"]["median"], 7, 0.5);
  EXPECT_LT(j["cloud"]["accuracy_mm"]["within_5mm"], 0.2);
  EXPECT_GT(j["cloud"]["accuracy_mm"]["within_10mm"], 0.95);
  EXPECT_NEAR(j["joints"]["mean"], 5, 1);  // the alignment may take up a little
  EXPECT_GT(j["views"]["cielab_rmse"], 15);
  EXPECT_LT(j["views"]["cielab_rmse"], 40);
}

TEST_F(Evaluate, a_moved_camera_is_measured_after_alignment) {
  write_truth();
  const Bundle bundle = write_bundle({});
  auto model = read_colmap_model(bundle.work("cameras"));
  ASSERT_TRUE(model);
  Pose& pose = model->images.at(1).cam_from_world;
  pose.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(0.01, Eigen::Vector3d::UnitY())) * pose.rotation;
  const Eigen::Vector3d centre = centre_of(poses[0]);
  pose.translation = -(pose.rotation * centre);  // turned on the spot
  ASSERT_TRUE(write_colmap_model(*model, bundle.work("cameras")));
  const json j = figures(bundle);
  EXPECT_LT(j["cameras"]["centre_mm"]["max"], 1e-6);
  EXPECT_NEAR(j["cameras"]["rotation_deg"]["max"], 0.01 * 180 / M_PI, 1e-9);
  EXPECT_LT(j["cameras"]["rotation_deg"]["median"], 1e-6);
}

TEST_F(Evaluate, missing_parts_are_null_with_a_reason) {
  write_truth();
  const Bundle bundle = write_bundle({});
  std::filesystem::remove_all(bundle.work("texture"));
  json j = figures(bundle);
  EXPECT_TRUE(j["views"].is_null());
  EXPECT_TRUE(j["missing"]["views"].is_string());
  EXPECT_FALSE(j["joints"].is_null());
  std::filesystem::remove_all(bundle.work("fit"));
  std::filesystem::remove_all(bundle.work("cloud"));
  j = figures(bundle);
  for (const char* part : {"cloud", "surface", "joints", "views", "seams", "held_out"}) {
    EXPECT_TRUE(j[part].is_null()) << part;
    EXPECT_TRUE(j["missing"][part].is_string()) << part;
  }
  EXPECT_EQ(j["registered"]["share"], 1.0);
  std::filesystem::remove_all(bundle.work("cameras"));
  j = figures(bundle);
  EXPECT_TRUE(j["registered"].is_null());
}

TEST_F(Evaluate, a_damaged_or_foreign_truth_is_an_error) {
  const Bundle bundle = write_bundle({});
  EXPECT_FALSE(evaluate(bundle, root / "nowhere"));
  std::filesystem::create_directories(truth_folder() / "orbit-body");
  for (const char* text : {"", "[]", "{\"format\":\"synth-capture-1\",\"frames\":[{}]}", "{\"format\":\"other\"}"}) {
    ASSERT_TRUE(write_file(truth_folder() / "orbit-body" / "truth.json", text));
    EXPECT_FALSE(evaluate(bundle, truth_folder())) << text;
  }
}

}  // namespace
}  // namespace gyre
