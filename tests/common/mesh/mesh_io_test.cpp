// SPDX-License-Identifier: Apache-2.0
#include "common/mesh/mesh_io.h"

#include "common/bundle/atomic_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

namespace gyre {
namespace {

class MeshIoTest : public testing::Test {
 protected:
  void SetUp() override {
    file_ = std::filesystem::path(testing::TempDir()) / ("mesh-" + std::to_string(::getpid()) + "-" +
                                                         testing::UnitTest::GetInstance()->current_test_info()->name());
  }
  void TearDown() override { std::filesystem::remove(file_); }
  std::filesystem::path file_;
};

TriangleMesh tetrahedron() {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  return mesh;
}

TEST_F(MeshIoTest, PlyRoundTrip) {
  TriangleMesh mesh = tetrahedron();
  mesh.normals = vertex_normals(mesh.vertices, mesh.triangles);
  mesh.colours.assign(4, Rgb(1, 200, 255));
  ASSERT_TRUE(write_ply(mesh, file_));
  const Result<TriangleMesh> read = read_ply(file_);
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_EQ(read->vertices, mesh.vertices);
  EXPECT_EQ(read->triangles, mesh.triangles);
  EXPECT_EQ(read->colours, mesh.colours);
  EXPECT_TRUE(read->normals[0].isApprox(mesh.normals[0], 1e-6));
}

TEST_F(MeshIoTest, CloudRoundTrip) {
  PointCloud cloud;
  cloud.points = {{1, 2, 3}, {4, 5, 6}};
  cloud.normals = {{1, 0, 0}, {0, 1, 0}};
  cloud.colours = {Rgb(9, 8, 7), Rgb(0, 128, 255)};
  cloud.confidence = {0.25F, 1.0F};
  cloud.deviation = {0.002F, 0.0005F};
  cloud.views = {3, 255};
  ASSERT_TRUE(write_cloud(cloud, file_));
  const Result<PointCloud> read = read_cloud(file_);
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_EQ(read->points, cloud.points);
  EXPECT_EQ(read->normals, cloud.normals);
  EXPECT_EQ(read->colours, cloud.colours);
  EXPECT_EQ(read->confidence, cloud.confidence);
  EXPECT_EQ(read->deviation, cloud.deviation);
  EXPECT_EQ(read->views, cloud.views);
}

TEST_F(MeshIoTest, ACloudWithoutDeviationAndViewsIsRead) {
  ASSERT_TRUE(write_file(file_,
                         "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                         "property float z\nproperty float confidence\nend_header\n1 2 3 0.5\n"));
  const Result<PointCloud> read = read_cloud(file_);
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_EQ(read->confidence, std::vector<float>{0.5F});
  EXPECT_TRUE(read->deviation.empty());
  EXPECT_TRUE(read->views.empty());
}

TEST_F(MeshIoTest, AnImpossibleNumberOfViewsIsLimitedToPossibleOnes) {
  ASSERT_TRUE(write_file(file_,
                         "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                         "property float z\nproperty int view_count\nend_header\n1 2 3 -4\n1 2 3 7\n1 2 3 1000\n"));
  const Result<PointCloud> read = read_cloud(file_);
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_EQ(read->views, (std::vector<std::uint8_t>{0, 7, 255}));
}

TEST_F(MeshIoTest, AsciiPolygonsBecomeFans) {
  ASSERT_TRUE(write_file(
      file_,
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\n"
      "element face 1\nproperty list uchar int vertex_index\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n"));
  const Result<TriangleMesh> read = read_ply(file_);
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_EQ(read->triangles, (std::vector<Eigen::Vector3i>{{0, 1, 2}, {0, 2, 3}}));
}

TEST_F(MeshIoTest, EveryCutOfAPlyIsAnErrorAndNeverACrash) {
  ASSERT_TRUE(write_ply(tetrahedron(), file_));
  const std::string whole = *read_file(file_);
  for (std::size_t size = 0; size < whole.size(); ++size) {
    ASSERT_TRUE(write_file(file_, whole.substr(0, size)));
    EXPECT_FALSE(read_ply(file_)) << size;
  }
}

TEST_F(MeshIoTest, ForeignIndicesAreRefused) {
  TriangleMesh mesh = tetrahedron();
  mesh.triangles.emplace_back(0, 1, 1000000);
  ASSERT_TRUE(write_ply(mesh, file_));
  EXPECT_FALSE(read_ply(file_));
  ASSERT_TRUE(write_file(file_, "v 0 0 0\nf 1 2 3\n"));
  EXPECT_FALSE(read_obj(file_));
  ASSERT_TRUE(write_file(file_, "ply\nformat ascii 1.0\nelement vertex 99999999999\nproperty float x\nend_header\n"));
  EXPECT_FALSE(read_ply(file_));
}

TEST_F(MeshIoTest, ObjRoundTripKeepsTextureCoordinates) {
  TriangleMesh mesh = tetrahedron();
  mesh.uv = {{0, 0}, {1, 0.25}, {0.5, 1}};
  mesh.uv_triangles.assign(4, {0, 1, 2});
  ASSERT_TRUE(write_obj(mesh, file_));
  const Result<TriangleMesh> read = read_obj(file_);
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_EQ(read->vertices, mesh.vertices);
  EXPECT_EQ(read->triangles, mesh.triangles);
  EXPECT_EQ(read->uv_triangles, mesh.uv_triangles);
  EXPECT_EQ(read->uv, mesh.uv);
}

TEST(VertexNormals, OfASphereLikeSolidPointOutwards) {
  const TriangleMesh mesh = tetrahedron();
  const auto normals = vertex_normals(mesh.vertices, mesh.triangles);
  const Eigen::Vector3d centre(0.25, 0.25, 0.25);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_GT(normals[i].dot(mesh.vertices[i] - centre), 0);
}

}  // namespace
}  // namespace gyre
