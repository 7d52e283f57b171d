// SPDX-License-Identifier: Apache-2.0
// The template built from the real sources; needs $GYRE_TEMPLATE_SOURCES.
#include "offload/body/template_build.h"

#include "offload/body/ansur.h"
#include "offload/body/body_measures.h"
#include "offload/body/humanoid.h"
#include "offload/body/landmark_set.h"
#include "offload/body/template_check.h"
#include "tests/temporary_folder.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

class TemplateBuild : public testing::Test {
 protected:
  static std::filesystem::path sources() {
    const char* folder = std::getenv("GYRE_TEMPLATE_SOURCES");
    return folder ? folder : "";
  }
  void SetUp() override {
    if (sources().empty()) GTEST_SKIP() << "set GYRE_TEMPLATE_SOURCES to the folder of the template sources";
  }
  static const BodyTemplate& body() {
    static const BodyTemplate built = [] {
      TemplateBuildOptions options;
      options.bodies.count = 80;
      Result<BodyTemplate> result = build_template(sources(), options);
      EXPECT_TRUE(result) << result.error().message();
      return result ? std::move(*result) : BodyTemplate{};
    }();
    return built;
  }
};

TEST_F(TemplateBuild, PassesTheCheck) {
  for (const TemplateFinding& finding : check_template(body())) EXPECT_FALSE(finding.is_error) << finding.what;
}

TEST_F(TemplateBuild, HasTheArkitExpressionsThenTheVisemes) {
  ASSERT_EQ(body().expressions.size(), arkit_expressions().size() + oculus_visemes().size());
  for (std::size_t i = 0; i < arkit_expressions().size(); ++i)
    EXPECT_EQ(body().expressions[i].name, arkit_expressions()[i]);
  for (std::size_t i = 0; i < oculus_visemes().size(); ++i)
    EXPECT_EQ(body().expressions[arkit_expressions().size() + i].name, oculus_visemes()[i]);
}

TEST_F(TemplateBuild, HasAllLandmarks) {
  for (const std::string& name : landmark_names()) EXPECT_TRUE(body().landmarks.count(name)) << name;
  const auto at = [&](const char* name) { return body().mesh.vertices[body().landmarks.at(name)]; };
  EXPECT_LT(at("leftEarLobe").y(), at("leftEar").y());
  EXPECT_GT(at("leftJawAngle").x(), at("leftJaw").x());
  EXPECT_GT(at("leftJaw").x(), 0.02);
  EXPECT_GT(at("leftJawAngle").y(), at("chin").y());
  EXPECT_LT((at("leftNostril") - at("noseBase")).norm(), 0.025);
}

// Heads differ above the neck only, and their eyes stay in their sockets.
TEST_F(TemplateBuild, HeadComponentsStayOnTheHead) {
  ASSERT_EQ(body().head_shapes.size(), 41U);
  const double neck = joint_positions(body(), body().mesh.vertices)[body().joint_index("upperChest")].y();
  for (const Morph& morph : body().head_shapes)
    for (int v : morph.vertices) EXPECT_GT(body().mesh.vertices[v].y(), neck) << morph.name;
  Eigen::VectorXd head = Eigen::VectorXd::Zero(41);
  for (Eigen::Index k = 0; k < head.size(); ++k) head[k] = std::sin(3.0 * static_cast<double>(k));
  const auto moved = shaped_vertices(body(), {}, head);
  const TemplatePart* eye = body().part("leftEye");
  const auto mean_of = [&](const std::vector<Eigen::Vector3d>& at, int first, int count) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int v = first; v < first + count; ++v) sum += at[v] / count;
    return sum;
  };
  const int inner = body().landmarks.at("leftEyeInner"), outer = body().landmarks.at("leftEyeOuter");
  const Eigen::Vector3d eye_moved = mean_of(moved, eye->first_vertex, eye->vertex_count) -
                                    mean_of(body().mesh.vertices, eye->first_vertex, eye->vertex_count);
  const Eigen::Vector3d corners_moved =
      0.5 * (moved[inner] + moved[outer] - body().mesh.vertices[inner] - body().mesh.vertices[outer]);
  EXPECT_LT((eye_moved - corners_moved).norm(), 3e-3);
}

TEST_F(TemplateBuild, MenAreTallerThanWomen) {
  const auto count = static_cast<std::size_t>(body().parts[0].vertex_count);
  const double men = stature(shaped_vertices(body(), body().shape_means.at("male")), count);
  const double women = stature(shaped_vertices(body(), body().shape_means.at("female")), count);
  EXPECT_NEAR(men, 1.756, 0.03);  // the survey's means
  EXPECT_NEAR(women, 1.629, 0.03);
}

TEST_F(TemplateBuild, ExpressionsMoveTheInnerParts) {
  const auto moves = [&](std::string_view expression, std::string_view part) {
    const TemplatePart* p = body().part(part);
    for (const Morph& morph : body().expressions)
      if (morph.name == expression)
        for (std::size_t i = 0; i < morph.vertices.size(); ++i)
          if (morph.vertices[i] >= p->first_vertex && morph.vertices[i] < p->first_vertex + p->vertex_count &&
              morph.offsets[i].norm() > 1e-3F)
            return true;
    return false;
  };
  EXPECT_TRUE(moves("jawOpen", "lowerTeeth"));
  EXPECT_TRUE(moves("jawOpen", "tongue"));
  EXPECT_FALSE(moves("jawOpen", "upperTeeth"));
  EXPECT_TRUE(moves("eyeLookUpLeft", "leftEye"));
  EXPECT_FALSE(moves("eyeLookUpLeft", "rightEye"));
  EXPECT_TRUE(moves("eyeBlinkRight", "lashes"));
  EXPECT_TRUE(moves("tongueOut", "tongue"));
}

TEST_F(TemplateBuild, MeanStatureIsTheSurveys) {
  const Result<Survey> survey = read_survey(sources() / "ansur");
  ASSERT_TRUE(survey);
  const double expected = 0.5 * (survey->female.mean[0] + survey->male.mean[0]);
  EXPECT_NEAR(stature(body().mesh.vertices, static_cast<std::size_t>(body().parts[0].vertex_count)), expected, 0.03);
}

TEST_F(TemplateBuild, FirstComponentIsMostlyStature) {
  double most = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Eigen::VectorXd one = Eigen::VectorXd::Unit(30, static_cast<Eigen::Index>(k));
    const auto count = static_cast<std::size_t>(body().parts[0].vertex_count);
    most =
        std::max(most, std::abs(stature(shaped_vertices(body(), one), count) - stature(body().mesh.vertices, count)));
  }
  EXPECT_GT(most, 0.03);  // metres of stature a standard deviation; the survey's is 0.09 over both sexes
  EXPECT_LT(most, 0.12);
}

TEST_F(TemplateBuild, FileKeepsItAndIsSmall) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "template.glb";
  ASSERT_TRUE(write_template(body(), file));
  EXPECT_LT(std::filesystem::file_size(file), 8U << 20);
  const Result<BodyTemplate> read = read_template(file);
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_TRUE(std::none_of(read->parts.begin(), read->parts.end(), [](const auto& p) { return p.vertex_count == 0; }));
  for (const TemplateFinding& finding : check_template(*read)) EXPECT_FALSE(finding.is_error) << finding.what;
}

TEST_F(TemplateBuild, ResultDoesNotDependOnThreads) {
  TemplateBuildOptions options;
  options.bodies.count = 8;
  options.components = 3;
  options.head_modes = 1;
  options.bodies.threads = 1;
  const Result<BodyTemplate> one = build_template(sources(), options);
  options.bodies.threads = 3;
  const Result<BodyTemplate> three = build_template(sources(), options);
  ASSERT_TRUE(one && three);
  EXPECT_EQ(one->mesh.vertices, three->mesh.vertices);
}

TEST(TemplateBuildOptions, AreChecked) {
  TemplateBuildOptions options;
  options.components = 31;
  EXPECT_FALSE(options.check());
  options.components = 24;
  options.bodies.count = 30;
  EXPECT_FALSE(options.check());
  options.bodies.count = 60;
  EXPECT_TRUE(options.check());
  options.head_modes = 0;
  EXPECT_FALSE(options.check());
  EXPECT_FALSE(build_template("/nowhere/at/all"));
}

}  // namespace
}  // namespace gyre
