// SPDX-License-Identifier: Apache-2.0
// Packed template files: round trip, and files that are not what they should be.
#include "common/bundle/atomic_file.h"
#include "offload/body/glb.h"
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
    body.head_shapes.push_back({"headMean", {5, 60, 400}, {{0.01F, 0, 0}, {0, 0.005F, -0.004F}, {0, 0, 0.02F}}});
    body.head_shapes.push_back({"head0", {60, 61}, {{1e-3F, 0, 0}, {0, 5e-4F, 0}}});
    body.shape_means["female"] = Eigen::Vector3d(0.5, -0.25, 1);
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
  ASSERT_EQ(read->head_shapes.size(), 2U);
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_EQ(read->head_shapes[k].name, body.head_shapes[k].name);
    EXPECT_EQ(read->head_shapes[k].vertices, body.head_shapes[k].vertices);
    for (std::size_t i = 0; i < body.head_shapes[k].offsets.size(); ++i)
      EXPECT_LT((read->head_shapes[k].offsets[i] - body.head_shapes[k].offsets[i]).norm(), 2e-5F);
  }
  EXPECT_EQ(read->shape_means, body.shape_means);
  for (std::size_t j = 0; j < body.joints.size(); ++j) {
    EXPECT_EQ(read->joints[j].range.axes, body.joints[j].range.axes);
    EXPECT_EQ(read->joints[j].range.least, body.joints[j].range.least);
    EXPECT_EQ(read->joints[j].range.most, body.joints[j].range.most);
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

// A flipped bit anywhere in the arrays or the extras is noticed, whatever it would have meant.
TEST_F(TemplateFile, ChangedContentDoesNotHaveItsChecksum) {
  ASSERT_TRUE(write_template(sample(), file("a.glb")));
  const std::string whole = *read_file(file("a.glb"));
  std::string changed = whole;
  changed[changed.size() - 1000] = static_cast<char>(changed[changed.size() - 1000] ^ 1);
  ASSERT_TRUE(write_file(file("b.glb"), std::string_view(changed)));
  const Result<BodyTemplate> read = read_template(file("b.glb"));
  ASSERT_FALSE(read);
  EXPECT_NE(read.error().message().find("checksum"), std::string::npos) << read.error().message();
}

// What a studio writes itself: vertices split at seams, no tables, morph targets for everything.
class StudioFile : public TemplateFile {
 protected:
  // A wedge of four corners, one of them split at a seam, with two joints.
  static GlbWriter wedge() {
    GlbWriter glb;
    const std::vector<float> positions = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 0};
    const std::vector<float> uv = {0, 0, 1, 0, 0, 1, 0.5F, 0.5F, 1, 1};
    const std::vector<std::uint8_t> joints = {0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0};
    const std::vector<float> weights = {1, 0, 0, 0, 0.5F, 0.5F, 0,     0,     0.25F, 0.75F,
                                        0, 0, 0, 1, 0,    0,    0.25F, 0.75F, 0,     0};
    const std::vector<std::uint16_t> triangles = {0, 2, 1, 0, 1, 3, 0, 3, 4, 1, 2, 3};
    const std::vector<float> smile = {0, 0, 0, 0.1F, 0, 0, 0, 0.2F, 0, 0, 0, 0, 0, 0.2F, 0};
    const std::vector<float> tall = {0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0};
    nlohmann::json primitive;
    primitive["attributes"] = {{"POSITION", glb.add_accessor(positions, "VEC3", 3)},
                               {"TEXCOORD_0", glb.add_accessor(uv, "VEC2", 2)},
                               {"JOINTS_0", glb.add_accessor(joints, "VEC4", 4)},
                               {"WEIGHTS_0", glb.add_accessor(weights, "VEC4", 4)}};
    primitive["indices"] = glb.add_accessor(triangles, "SCALAR", 1);
    for (const auto& target : {smile, tall}) {
      nlohmann::json one;
      one["POSITION"] = glb.add_accessor(target, "VEC3", 3);
      primitive["targets"].push_back(one);
    }
    const nlohmann::json joint_list = {
        {{"name", "hips"}, {"parent", -1}, {"vertices", {0}}, {"weights", {1.0}}},
        {{"name", "leftHand"}, {"parent", 0}, {"vertices", {1, 2}}, {"weights", {0.5, 0.5}}}};
    const nlohmann::json component = {
        {"name", "stature"}, {"role", "body"}, {"target", "tall"}, {"standard_deviation", 0.25}};
    nlohmann::json extras;
    extras["targetNames"] = {"mouthSmileLeft", "tall"};
    extras["gyre_template"] = {{"version", 2},
                               {"name", "wedge"},
                               {"joints", joint_list},
                               {"components", nlohmann::json::array({component})},
                               {"landmarks", {{"crown", 2}}}};
    glb.json["meshes"] = nlohmann::json::array();
    glb.json["meshes"].push_back({{"primitives", nlohmann::json::array({primitive})}, {"extras", extras}});
    return glb;
  }
  Result<BodyTemplate> read(GlbWriter glb) const {
    if (const auto ok = glb.write(file("studio.glb")); !ok) return tl::unexpected(ok.error());
    return read_template(file("studio.glb"));
  }
};

TEST_F(StudioFile, TablesAreMadeWhereTheyAreMissing) {
  const Result<BodyTemplate> body = read(wedge());
  ASSERT_TRUE(body) << body.error().message();
  ASSERT_EQ(body->mesh.vertices.size(), 4U);
  EXPECT_EQ(body->mesh.triangles[2], Eigen::Vector3i(0, 3, 2));
  EXPECT_EQ(body->mesh.uv_triangles[2], Eigen::Vector3i(0, 3, 4));
  EXPECT_EQ(body->skin[2].weight[1], 0.75F);
  EXPECT_EQ(body->parts.size(), 1U);
  EXPECT_EQ(body->regions[3], BodyRegion::left_hand);
  EXPECT_EQ(body->regions[0], BodyRegion::torso);
  EXPECT_EQ(body->mirror[2], 2);
  EXPECT_EQ(body->mirror[1], -1);
  ASSERT_EQ(body->expressions.size(), 1U);
  EXPECT_EQ(body->expressions[0].name, "mouthSmileLeft");
  EXPECT_EQ(body->expressions[0].vertices, (std::vector<int>{1, 2}));
  ASSERT_EQ(body->shapes.size(), 1U);
  EXPECT_EQ(body->shapes[0].name, "stature");
  EXPECT_EQ(body->shapes[0].offsets[0], Eigen::Vector3f(0, 0.25F, 0));
  EXPECT_EQ(body->landmarks.at("crown"), 2);
}

TEST_F(StudioFile, TheErrorNamesWhatIsMissing) {
  const auto message_without = [&](const nlohmann::json::json_pointer& entry, const std::string& key) {
    GlbWriter glb = wedge();
    glb.json[entry].erase(key);
    const Result<BodyTemplate> body = read(glb);
    return body ? std::string() : body.error().message();
  };
  const nlohmann::json::json_pointer extras("/meshes/0/extras/gyre_template"), primitive("/meshes/0/primitives/0");
  for (const char* key : {"version", "name", "joints", "components", "landmarks"})
    EXPECT_NE(message_without(extras, key).find("lacks gyre_template." + std::string(key)), std::string::npos) << key;
  EXPECT_NE(message_without(primitive / "attributes", "WEIGHTS_0").find("WEIGHTS_0"), std::string::npos);
  EXPECT_NE(message_without(primitive, "indices").find("indices"), std::string::npos);
  EXPECT_NE(message_without(extras / "joints" / 1, "weights").find("weights"), std::string::npos);
  EXPECT_NE(message_without(extras / "components" / 0, "target").find("stature"), std::string::npos);
  GlbWriter glb = wedge();
  glb.json[extras]["components"][0]["target"] = "nobody";
  const Result<BodyTemplate> body = read(glb);
  ASSERT_FALSE(body);
  EXPECT_NE(body.error().message().find("nobody"), std::string::npos);
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
  std::string whole = *read_file(file("a.glb"));
  whole.replace(whole.find("\"checksum\""), 10, "\"unsealed\"");  // else its checksum ends the reading at once
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
