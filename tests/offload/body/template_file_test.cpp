// SPDX-License-Identifier: Apache-2.0
// Packed template files: round trip, and files that are not what they should be.
#include "common/bundle/atomic_file.h"
#include "offload/body/template.h"
#include "tests/temporary_folder.h"

#include <gtest/gtest.h>
#include <random>

namespace gyre {
namespace {

class TemplateFile : public testing::Test {
 protected:
  std::filesystem::path file(const std::string& name) const { return folder_.path() / name; }

  // The built-in human with an expression, so that morph targets are covered.
  static BodyTemplate sample() {
    BodyTemplate body = built_in_template();
    body.expressions.push_back({"jawOpen", {3, 70, 500}, {{0, -0.01F, 0}, {0, 0.02F, 0.001F}, {0.5F, 0, 0}}});
    body.expressions.push_back({"still", {}, {}});
    return body;
  }

 private:
  TemporaryFolder folder_;
};

TEST_F(TemplateFile, RoundTrip) {
  const BodyTemplate body = sample();
  ASSERT_TRUE(write_template(body, file("a.glb")));
  const Result<BodyTemplate> read = read_template(file("a.glb"));
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_EQ(read->name, body.name);
  EXPECT_EQ(read->notices, body.notices);
  EXPECT_EQ(read->built_in, body.built_in);
  EXPECT_EQ(read->checksum.size(), 64U);
  EXPECT_EQ(read->mesh.triangles, body.mesh.triangles);
  EXPECT_EQ(read->mirror, body.mirror);
  EXPECT_EQ(read->regions, body.regions);
  EXPECT_EQ(read->landmarks, body.landmarks);
  ASSERT_EQ(read->mesh.vertices.size(), body.mesh.vertices.size());
  for (std::size_t v = 0; v < body.mesh.vertices.size(); ++v) {
    ASSERT_LT((read->mesh.vertices[v] - body.mesh.vertices[v]).norm(), 1e-6);
    ASSERT_EQ(read->skin[v].joint, body.skin[v].joint);
    ASSERT_EQ(read->skin[v].weight, body.skin[v].weight);
  }
  for (std::size_t t = 0; t < body.mesh.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k)
      ASSERT_LT((read->mesh.uv[read->mesh.uv_triangles[t][k]] - body.mesh.uv[body.mesh.uv_triangles[t][k]]).norm(),
                1e-6);
  ASSERT_EQ(read->joints.size(), body.joints.size());
  for (std::size_t j = 0; j < body.joints.size(); ++j) {
    EXPECT_EQ(read->joints[j].name, body.joints[j].name);
    EXPECT_EQ(read->joints[j].parent, body.joints[j].parent);
    EXPECT_EQ(read->joints[j].regressor, body.joints[j].regressor);
  }
  ASSERT_EQ(read->shapes.size(), body.shapes.size());
  for (std::size_t k = 0; k < body.shapes.size(); ++k) {
    const Eigen::VectorXd one =
        Eigen::VectorXd::Unit(static_cast<Eigen::Index>(body.shapes.size()), static_cast<Eigen::Index>(k));
    const auto before = shaped_vertices(body, one), after = shaped_vertices(*read, one);
    for (std::size_t v = 0; v < before.size(); ++v) ASSERT_LT((before[v] - after[v]).norm(), 1e-5);
  }
  ASSERT_EQ(read->expressions.size(), 2U);
  EXPECT_EQ(read->expressions[0].vertices, body.expressions[0].vertices);
  EXPECT_EQ(read->expressions[0].offsets, body.expressions[0].offsets);
  EXPECT_TRUE(read->expressions[1].vertices.empty());
}

TEST_F(TemplateFile, WritingTwiceGivesTheSameBytes) {
  ASSERT_TRUE(write_template(sample(), file("a.glb")));
  ASSERT_TRUE(write_template(sample(), file("b.glb")));
  EXPECT_EQ(*read_file(file("a.glb")), *read_file(file("b.glb")));
}

TEST_F(TemplateFile, MissingOrForeignFilesAreErrors) {
  EXPECT_FALSE(read_template(file("none.glb")));
  for (const std::string& content : {std::string(), std::string("glTF"), std::string(100, 'x')}) {
    ASSERT_TRUE(write_file(file("bad.glb"), std::string_view(content)));
    const Result<BodyTemplate> read = read_template(file("bad.glb"));
    ASSERT_FALSE(read);
    EXPECT_NE(read.error().message().find("bad.glb"), std::string::npos);
  }
}

TEST_F(TemplateFile, TruncatedFilesAreErrors) {
  ASSERT_TRUE(write_template(sample(), file("a.glb")));
  const std::string whole = *read_file(file("a.glb"));
  for (int i = 0; i < 40; ++i) {
    const std::string part = whole.substr(0, whole.size() * static_cast<std::size_t>(i) / 40);
    ASSERT_TRUE(write_file(file("cut.glb"), std::string_view(part)));
    EXPECT_FALSE(read_template(file("cut.glb"))) << part.size() << " bytes";
  }
}

// Whatever the damage, reading ends with an error or with a template whose indices are all in range.
TEST_F(TemplateFile, DamagedFilesDoNotCrash) {
  ASSERT_TRUE(write_template(sample(), file("a.glb")));
  const std::string whole = *read_file(file("a.glb"));
  std::mt19937 random(7);
  for (int i = 0; i < 60; ++i) {
    std::string damaged = whole;
    for (int k = 0; k < 8; ++k) damaged[random() % (i % 2 ? damaged.size() : 40000)] = static_cast<char>(random());
    ASSERT_TRUE(write_file(file("bad.glb"), std::string_view(damaged)));
    const Result<BodyTemplate> read = read_template(file("bad.glb"));
    if (!read) continue;
    const auto vertices = static_cast<int>(read->mesh.vertices.size());
    for (const auto& t : read->mesh.triangles) ASSERT_TRUE(t.minCoeff() >= 0 && t.maxCoeff() < vertices);
    for (const auto& skin : read->skin)
      for (int joint : skin.joint) ASSERT_TRUE(joint >= 0 && joint < static_cast<int>(read->joints.size()));
  }
}

TEST_F(TemplateFile, FindTemplateRefusesABrokenGivenOne) {
  ASSERT_TRUE(write_file(file("bad.glb"), std::string_view("nonsense")));
  EXPECT_FALSE(find_template(file("bad.glb")));
}

}  // namespace
}  // namespace gyre
