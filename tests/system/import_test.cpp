// SPDX-License-Identifier: Apache-2.0
// A reconstructed avatar in the hands of others: the Khronos validator and Blender.
#include "common/bundle/atomic_file.h"
#include "common/bundle/bundle.h"
#include "offload/body/humanoid.h"
#include "tests/offload/avatar/vrm_rules.h"
#include "tests/system/programs.h"

#include <gtest/gtest.h>
#include <unistd.h>
#include <cstring>
#include <nlohmann/json.hpp>

namespace gyre {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

class ImportTest : public testing::Test {
 protected:
  // Not once for the suite: a suite's failed set-up reads as skipped tests.
  void SetUp() override {
    root_ = fs::path(testing::TempDir()) /
            ("import-" + std::to_string(::getpid()) + testing::UnitTest::GetInstance()->current_test_info()->name());
    const std::string capture = (root_ / "capture").string();
    ASSERT_EQ(run_program("synthetic_capture",
                          {capture, "--sequence", "orbit-body", "--frames", "90", "--width", "270", "--height", "480"})
                  .code,
              0);
    const Finished f = run_program("gyre-offload", {"reconstruct", capture + "/video.mp4", "--out", out(),
                                                    "--height-mm", "1700", "--texture-size", "1024"});
    ASSERT_EQ(f.code, 0) << f.err;
  }
  void TearDown() override { fs::remove_all(root_); }

  std::string out() const { return (root_ / "out").string(); }
  std::string avatar() const { return out() + "/avatar.glb"; }

  // What Blender says of an avatar; null when it did not take it.
  static json imported(const std::vector<std::string>& arguments) {
    std::vector<std::string> all{"blender",
                                 "--background",
                                 "--factory-startup",
                                 "--python-exit-code",
                                 "1",
                                 "--python",
                                 GYRE_SYSTEM_TESTS "/avatar_import.py",
                                 "--"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    const Finished f = run_program("/usr/bin/env", all);
    EXPECT_EQ(f.code, 0) << f.err << f.out << "\n('./dev setup --all' installs Blender)";
    const std::size_t begin = f.out.find("{\"vertices\"");
    if (f.code != 0 || begin == std::string::npos) return nullptr;
    return json::parse(f.out.substr(begin, f.out.find('\n', begin) - begin));
  }

  // The JSON chunk of a GLB or VRM.
  static json gltf(const fs::path& file) {
    const std::string bytes = read_file(file).value_or("");
    std::uint32_t length = 0;
    if (bytes.size() < 20) return {};
    std::memcpy(&length, bytes.data() + 12, sizeof length);
    return json::parse(bytes.substr(20, length));
  }

  fs::path root_;
};

// World positions of the named nodes below `node`, from their translations (the bind pose turns nothing).
void node_positions(const json& gltf, int node, std::array<double, 3> at,
                    std::map<std::string, std::array<double, 3>>& into) {
  const json& n = gltf.at("nodes").at(static_cast<std::size_t>(node));
  EXPECT_FALSE(n.contains("rotation") || n.contains("scale") || n.contains("matrix"));
  const auto by = n.value("translation", std::array<double, 3>{0, 0, 0});
  for (std::size_t i = 0; i < 3; ++i) at[i] += by[i];
  into[n.value("name", "")] = at;
  for (const int child : n.value("children", std::vector<int>())) node_positions(gltf, child, at, into);
}

TEST_F(ImportTest, TheValidatorFindsNothing) {
  const Finished f = run_program("/usr/bin/env", {"node", GYRE_SYSTEM_TESTS "/gltf_validate.mjs", avatar()});
  ASSERT_EQ(f.code, 0) << f.err << f.out << "\n('./dev setup --all' installs the validator)";
  const json issues = json::parse(f.out).at("issues");
  EXPECT_EQ(issues.at("numErrors"), 0) << issues.dump(1);
  EXPECT_EQ(issues.at("numWarnings"), 0) << issues.dump(1);
}

TEST_F(ImportTest, BlenderReadsSkeletonSkinAndShapes) {
  const fs::path pictures = root_ / "pictures";
  const json facts = imported({avatar(), pictures.string()});
  ASSERT_FALSE(facts.is_null());

  EXPECT_TRUE(facts.at("armature_modifier"));
  EXPECT_EQ(facts.at("uv_layers"), 1);
  EXPECT_EQ(facts.at("images"), 1);
  EXPECT_NEAR(facts.at("weight_sum_min").get<double>(), 1.0, 1e-3);
  EXPECT_NEAR(facts.at("weight_sum_max").get<double>(), 1.0, 1e-3);
  EXPECT_LE(facts.at("influences_max"), 4);

  std::map<std::string, std::array<double, 3>> nodes;
  const json scene = gltf(avatar());
  for (const int root : scene.at("scenes").at(0).at("nodes").get<std::vector<int>>())
    node_positions(scene, root, {0, 0, 0}, nodes);
  for (const HumanoidBone& bone : humanoid_bones()) {
    ASSERT_TRUE(facts.at("heads_m").contains(bone.name)) << bone.name;
    const auto head = facts.at("heads_m").at(bone.name).get<std::array<double, 3>>();
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(head[i], nodes.at(bone.name)[i], 1e-4) << bone.name;
  }

  const bool has_face = !json::parse(read_file(Bundle(out()).work("fit") / "fit.json").value_or("{}"))
                             .at("template")
                             .at("built_in")
                             .get<bool>();
  if (has_face) {
    for (const std::string_view name : arkit_expressions())
      EXPECT_GT(facts.at("moved_by_shape_key").value(std::string(name), 0), 0) << name;
  }
  for (const char* picture : {"front", "left", "back", "right", "face", "raised_arm"})
    EXPECT_GT(fs::file_size(pictures / (std::string(picture) + ".png")), 10'000U) << picture;
}

TEST_F(ImportTest, BlenderReadsTheSameFromFbxAsFromGlb) {
  const json glb = imported({avatar()}), fbx = imported({out() + "/avatar.fbx"});
  ASSERT_FALSE(glb.is_null() || fbx.is_null());
  EXPECT_EQ(fbx.at("triangles"), glb.at("triangles"));
  EXPECT_EQ(fbx.at("bones"), glb.at("bones"));
  EXPECT_EQ(fbx.at("images"), 1);
  EXPECT_EQ(fbx.at("uv_layers"), 1);
  EXPECT_TRUE(fbx.at("armature_modifier"));
  EXPECT_LE(fbx.at("influences_max"), 4);
  EXPECT_NEAR(fbx.at("weight_sum_min").get<double>(), 1.0, 1e-3);
  const auto expect_near = [](const json& a, const json& b, double tolerance, const std::string& what) {
    const auto p = a.get<std::array<double, 3>>(), q = b.get<std::array<double, 3>>();
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(p[i], q[i], tolerance) << what;
  };
  for (const auto& [bone, head] : glb.at("heads_m").items()) expect_near(fbx.at("heads_m").at(bone), head, 1e-4, bone);
  ASSERT_EQ(fbx.at("shape_keys"), glb.at("shape_keys"));
  for (const auto& [name, move] : glb.at("farthest_by_shape_key").items()) {
    const auto length = [](const json& by) {
      const auto v = by.get<std::array<double, 3>>();
      return std::hypot(v[0], v[1], v[2]);
    };
    // The farthest vertex may have a mirror image that moves as far.
    EXPECT_NEAR(length(fbx.at("farthest_by_shape_key").at(name).at("by")), length(move.at("by")), 1e-4) << name;
  }
}

TEST_F(ImportTest, ThreeVrmReadsTheVrm) {
  const Finished f = run_program("/usr/bin/env", {"node", GYRE_SYSTEM_TESTS "/vrm_load.mjs", out() + "/avatar.vrm"});
  ASSERT_EQ(f.code, 0) << f.err << f.out << "\n('./dev setup --all' installs three-vrm)";
  const json facts = json::parse(f.out);
  for (const HumanoidBone& bone : humanoid_bones()) EXPECT_TRUE(facts.at("bones").contains(bone.name)) << bone.name;
  const auto height = [&](const char* bone) { return facts.at("bones").at(bone).at(1).get<double>(); };
  for (const char* side : {"left", "right"}) {
    const std::string arm = std::string(side) + "UpperArm", hand = std::string(side) + "Hand";
    EXPECT_NEAR(height(arm.c_str()), height(hand.c_str()), 0.002) << "a T-pose holds its arms level";
  }
  EXPECT_EQ(facts.at("meta").at("avatarPermission"), "onlyAuthor");
  EXPECT_EQ(vrm_faults(gltf(out() + "/avatar.vrm")), std::vector<std::string>());
  const Finished valid =
      run_program("/usr/bin/env", {"node", GYRE_SYSTEM_TESTS "/gltf_validate.mjs", out() + "/avatar.vrm"});
  EXPECT_EQ(valid.code, 0) << valid.out;
}

}  // namespace
}  // namespace gyre
