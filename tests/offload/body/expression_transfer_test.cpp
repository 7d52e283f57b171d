// SPDX-License-Identifier: Apache-2.0
// All expressions on people of random shape: what an animator counts on. Needs the real template, which is built from
// its sources ($GYRE_TEMPLATE_SOURCES); the built-in human has no face rig.
#include "offload/body/expression_transfer.h"

#include "offload/body/template_build.h"
#include "tests/offload/body/eye_cover.h"
#include "tests/offload/body/random_person.h"

#include <gtest/gtest.h>
#include <cstdlib>

namespace gyre {
namespace {

using Points = std::vector<Eigen::Vector3d>;

const BodyTemplate* human() {
  static const std::unique_ptr<BodyTemplate> body = []() -> std::unique_ptr<BodyTemplate> {
    if (const char* file = std::getenv("GYRE_TEMPLATE"); file != nullptr && *file) {
      auto read = read_template(file);
      return read ? std::make_unique<BodyTemplate>(std::move(*read)) : nullptr;
    }
    const char* sources = std::getenv("GYRE_TEMPLATE_SOURCES");
    if (sources == nullptr || !*sources) return nullptr;
    TemplateBuildOptions options;
    auto built = build_template(sources, options);
    return built ? std::make_unique<BodyTemplate>(std::move(*built)) : nullptr;
  }();
  return body.get();
}

class Expressions : public testing::Test {
 protected:
  void SetUp() override {
    if (human() == nullptr) GTEST_SKIP() << "no $GYRE_TEMPLATE_SOURCES";
  }

  static int index_of(const std::string& name) {
    for (std::size_t e = 0; e < human()->expressions.size(); ++e)
      if (human()->expressions[e].name == name) return static_cast<int>(e);
    return -1;
  }

  // Rest plus the expression at full strength, and what it is meant to be added to.
  static Points look(const Points& rest, const std::vector<Morph>& expressions, std::size_t e) {
    Points state = rest;
    add_morph(state, expressions[e], 1.0);
    const std::string base = ExpressionTransfer::base_of(expressions[e].name);
    if (!base.empty()) add_morph(state, expressions[static_cast<std::size_t>(index_of(base))], 1.0);
    return state;
  }

  static Eigen::Vector3d mean_offset(const Points& rest, const Points& state, const std::string& part) {
    const TemplatePart& p = *human()->part(part);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int v = p.first_vertex; v < p.first_vertex + p.vertex_count; ++v) sum += state[v] - rest[v];
    return sum / p.vertex_count;
  }
};

TEST_F(Expressions, TheTemplateGetsItsOwnWhereNothingCollides) {
  const Points& rest = human()->mesh.vertices;
  const auto transferred = transfer_expressions(*human(), rest);
  const FaceContacts contacts(*human(), rest);
  int same = 0;
  for (std::size_t e = 0; e < transferred.size(); ++e) {
    const Points given = look(rest, human()->expressions, e), got = look(rest, transferred, e);
    bool clean = true;
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      const ContactState found = contacts.measure(i, given, given);
      clean = clean && found.crossing <= 0 && found.penetration <= 0 && found.mean_gap > 2e-4;
    }
    double largest = 0.0;
    for (std::size_t v = 0; v < rest.size(); ++v) largest = std::max(largest, (given[v] - got[v]).norm());
    if (clean && largest < 1e-5) ++same;
  }
  EXPECT_GE(same, 15);
}

TEST_F(Expressions, LidsAndLipsDoNotCrossAndEyesCloseOnAnyone) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Points rest = random_person(*human(), seed);
    const auto transferred = transfer_expressions(*human(), rest);
    const FaceContacts contacts(*human(), rest);
    ASSERT_EQ(contacts.size(), 3U);
    for (std::size_t e = 0; e < transferred.size(); ++e) {
      const std::string& name = transferred[e].name;
      const Points state = look(rest, transferred, e);
      const Points on_template = look(human()->mesh.vertices, human()->expressions, e);
      EXPECT_LT(eyeballs_through_lids(*human(), on_template, state), 3e-4) << name << " of person " << seed;
      for (std::size_t i = 0; i < contacts.size(); ++i) {
        const ContactState found = contacts.measure(i, state, on_template);
        const std::string& opening = contacts.opening(i).name;
        EXPECT_LT(found.crossing, 3e-4) << name << " " << opening << " of person " << seed;
        EXPECT_LT(found.penetration, 3e-4) << name << " " << opening << " of person " << seed;
        if ((name == "eyeBlinkLeft" && opening == "leftEye") || (name == "eyeBlinkRight" && opening == "rightEye")) {
          EXPECT_LT(found.widest_gap, 3e-4) << name << " of person " << seed;
          EXPECT_LT(std::abs(found.mean_gap), 1e-4) << name << " of person " << seed;
        }
        if (name == "jawOpen" && opening == "mouth") {
          EXPECT_GT(found.widest_gap, 0.02);
        }
      }
    }
  }
}

TEST_F(Expressions, InnerPartsMoveWithTheFace) {
  const Points rest = random_person(*human(), 4);
  const auto transferred = transfer_expressions(*human(), rest);
  const auto state_of = [&](const std::string& name) {
    return look(rest, transferred, static_cast<std::size_t>(index_of(name)));
  };
  // The lower teeth go down with the chin, the upper ones stay.
  const Points open = state_of("jawOpen");
  const int chin = human()->landmarks.at("chin");
  EXPECT_LT(mean_offset(rest, open, "lowerTeeth").y(), 0.4 * (open[chin] - rest[chin]).y());
  EXPECT_EQ(mean_offset(rest, open, "upperTeeth").norm(), 0.0);
  EXPECT_GT(mean_offset(rest, state_of("tongueOut"), "tongue").z(), 0.01);
  // An eyeball keeps its shape as well as the template's own does.
  const Points aside = state_of("eyeLookOutLeft");
  const Points& mean = human()->mesh.vertices;
  const Points template_aside = look(mean, human()->expressions, static_cast<std::size_t>(index_of("eyeLookOutLeft")));
  const TemplatePart& eye = *human()->part("leftEye");
  const int first = eye.first_vertex;
  for (int v = first + 1; v < first + eye.vertex_count; v += 7)
    EXPECT_NEAR((aside[v] - aside[first]).norm() / (rest[v] - rest[first]).norm(),
                (template_aside[v] - template_aside[first]).norm() / (mean[v] - mean[first]).norm(), 0.01);
  EXPECT_EQ(mean_offset(rest, aside, "rightEye").norm(), 0.0);
  int front = first;
  for (int v = first; v < first + eye.vertex_count; ++v)
    if (rest[v].z() > rest[front].z()) front = v;
  EXPECT_GT(aside[front].x() - rest[front].x(), 0.002);
  // The lashes of the upper lid go down with it.
  const Points blink = state_of("eyeBlinkLeft");
  const int lid = human()->landmarks.at("leftUpperLid");
  const TemplatePart& lashes = *human()->part("lashes");
  double lowest = 0.0;
  for (int v = lashes.first_vertex; v < lashes.first_vertex + lashes.vertex_count; ++v)
    lowest = std::min(lowest, (blink[v] - rest[v]).y());
  EXPECT_LT((blink[lid] - rest[lid]).y(), -3e-3);
  EXPECT_NEAR(lowest, (blink[lid] - rest[lid]).y(), 2e-3);
}

TEST_F(Expressions, TurnAndGrowWithTheHead) {
  const Points rest = random_person(*human(), 5);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.3, Eigen::Vector3d(0.2, 1, 0.1).normalized()).toRotationMatrix();
  Points turned;
  for (const Eigen::Vector3d& v : rest) turned.emplace_back(1.1 * (turn * v));
  const auto straight = transfer_expressions(*human(), rest), moved = transfer_expressions(*human(), turned);
  for (const char* name : {"mouthSmileLeft", "jawOpen", "browInnerUp"}) {
    const auto e = static_cast<std::size_t>(index_of(name));
    const Points a = look(rest, straight, e), b = look(turned, moved, e);
    double largest = 0.0;
    for (std::size_t v = 0; v < a.size(); ++v) largest = std::max(largest, (1.1 * (turn * a[v]) - b[v]).norm());
    EXPECT_LT(largest, 1e-3) << name;  // the face's own turn is estimated, and contacts have a size
  }
}

}  // namespace
}  // namespace gyre
