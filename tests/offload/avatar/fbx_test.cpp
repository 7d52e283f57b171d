// SPDX-License-Identifier: Apache-2.0
// Walks written files record by record, as the format's readers do.
#include "offload/avatar/fbx.h"

#include "tests/offload/avatar/small_template.h"

#include <gtest/gtest.h>
#include <zlib.h>
#include <cstring>
#include <map>

namespace gyre {
namespace {

struct Property {
  char type = 0;
  std::int64_t integer = 0;
  double real = 0;
  std::string text;
  std::vector<double> numbers;  // of an array
};

struct Record {
  std::string name;
  std::vector<Property> properties;
  std::vector<Record> children;

  const Record& child(const std::string& wanted) const {
    for (const Record& c : children)
      if (c.name == wanted) return c;
    ADD_FAILURE() << name << " has no " << wanted;
    static const Record none{"", {{}}, {}};
    return none;
  }
};

class Reader {
 public:
  explicit Reader(const std::vector<std::byte>& bytes) : bytes_(bytes) {}

  Record file() {
    EXPECT_EQ(std::memcmp(bytes_.data(), "Kaydara FBX Binary  \0\x1a\0", 23), 0);
    at_ = 23;
    EXPECT_EQ(take<std::uint32_t>(), 7400U);
    Record root;
    while (auto record = next()) root.children.push_back(std::move(*record));
    // Identifier, zeros up to a multiple of 16, version, zeros, identifier.
    EXPECT_EQ(bytes_.size() % 16, (4 + 120 + 16) % 16U);
    EXPECT_LE(bytes_.size() - at_, 16U + 4 + 16 + 4 + 120 + 16);
    return root;
  }

 private:
  template <class T>
  T take() {
    T value{};
    if (at_ + sizeof value > bytes_.size()) throw std::runtime_error("the file ends within a record");
    std::memcpy(&value, bytes_.data() + at_, sizeof value);
    at_ += sizeof value;
    return value;
  }

  std::string take_text(std::size_t size) {
    if (at_ + size > bytes_.size()) throw std::runtime_error("the file ends within a text");
    std::string text(reinterpret_cast<const char*>(bytes_.data()) + at_, size);
    at_ += size;
    return text;
  }

  template <class T>
  std::vector<double> take_array() {
    const auto count = take<std::uint32_t>(), encoding = take<std::uint32_t>(), size = take<std::uint32_t>();
    EXPECT_EQ(encoding, 1U);
    const std::string packed = take_text(size);
    std::vector<T> values(count);
    uLongf length = count * sizeof(T);
    EXPECT_EQ(uncompress(reinterpret_cast<Bytef*>(values.data()), &length,
                         reinterpret_cast<const Bytef*>(packed.data()), size),
              Z_OK);
    EXPECT_EQ(length, count * sizeof(T));
    return {values.begin(), values.end()};
  }

  std::optional<Record> next() {
    const std::size_t begin = at_;
    const auto end = take<std::uint32_t>(), count = take<std::uint32_t>(), length = take<std::uint32_t>();
    Record record;
    record.name = take_text(take<std::uint8_t>());
    if (end == 0) {
      EXPECT_EQ(at_ - begin, 13U);
      return std::nullopt;
    }
    const std::size_t properties = at_;
    for (std::uint32_t i = 0; i < count; ++i) {
      Property& p = record.properties.emplace_back();
      p.type = take<char>();
      switch (p.type) {
        case 'C':
          p.integer = take<std::uint8_t>();
          break;
        case 'I':
          p.integer = take<std::int32_t>();
          break;
        case 'L':
          p.integer = take<std::int64_t>();
          break;
        case 'D':
          p.real = take<double>();
          break;
        case 'S':
        case 'R':
          p.text = take_text(take<std::uint32_t>());
          break;
        case 'i':
          p.numbers = take_array<std::int32_t>();
          break;
        case 'd':
          p.numbers = take_array<double>();
          break;
        default:
          throw std::runtime_error("unknown type of property");
      }
    }
    EXPECT_EQ(at_ - properties, length) << record.name;
    if (at_ < end) {
      while (auto child = next()) record.children.push_back(std::move(*child));
    }
    EXPECT_EQ(at_, end) << record.name;
    return record;
  }

  const std::vector<std::byte>& bytes_;
  std::size_t at_ = 0;
};

class Fbx : public testing::Test {
 protected:
  void SetUp() override {
    avatar_.texture = {std::byte{1}, std::byte{2}};
    avatar_.texture_type = "image/png";
    bytes_ = write_fbx(avatar_);
    root_ = Reader(bytes_).file();
    for (const Record& object : root_.child("Objects").children) objects_[object.properties.at(0).integer] = &object;
  }

  // Objects of a kind and subtype, in the file's order.
  std::vector<const Record*> all(const std::string& kind, const std::string& subtype) const {
    std::vector<const Record*> found;
    for (const Record& object : root_.child("Objects").children)
      if (object.name == kind && object.properties.at(2).text == subtype) found.push_back(&object);
    return found;
  }

  // Ids that a child is connected to.
  std::vector<std::int64_t> parents(const Record& child) const {
    std::vector<std::int64_t> found;
    for (const Record& c : root_.child("Connections").children)
      if (c.properties.at(1).integer == child.properties.at(0).integer) found.push_back(c.properties.at(2).integer);
    return found;
  }

  const BodyTemplate body_ = small_template();
  Avatar avatar_ = *assemble_avatar(body_, body_.mesh.vertices, joint_positions(body_, body_.mesh.vertices));
  std::vector<std::byte> bytes_;
  Record root_;
  std::map<std::int64_t, const Record*> objects_;
};

TEST_F(Fbx, EveryConnectionJoinsTwoObjects) {
  for (const Record& c : root_.child("Connections").children) {
    EXPECT_TRUE(objects_.contains(c.properties.at(1).integer));
    EXPECT_TRUE(c.properties.at(2).integer == 0 || objects_.contains(c.properties.at(2).integer));
  }
  for (const auto& [id, object] : objects_)
    EXPECT_TRUE(object->name == "Pose" || !parents(*object).empty()) << object->name;
}

TEST_F(Fbx, WeldsWhatTextureSeamsHaveSplit) {
  const Record& geometry = *all("Geometry", "Mesh").at(0);
  const std::vector<double>& vertices = geometry.child("Vertices").properties.at(0).numbers;
  ASSERT_EQ(vertices.size(), 3 * body_.mesh.vertices.size());
  const std::vector<double>& corners = geometry.child("PolygonVertexIndex").properties.at(0).numbers;
  const std::vector<double>& uv = geometry.child("LayerElementUV").child("UV").properties.at(0).numbers;
  const std::vector<double>& uv_index = geometry.child("LayerElementUV").child("UVIndex").properties.at(0).numbers;
  ASSERT_EQ(corners.size(), 3 * body_.mesh.triangles.size());
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const int k = static_cast<int>(i % 3);
    const auto corner = static_cast<std::size_t>(k == 2 ? -corners[i] - 1 : corners[i]);
    const Eigen::Vector3d& truth = body_.mesh.vertices[body_.mesh.triangles[i / 3][k]];
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(vertices[3 * corner + c], 100 * truth[static_cast<int>(c)], 1e-5);
    const auto at = static_cast<std::size_t>(uv_index[i]);
    const Eigen::Vector2d& coordinate = body_.mesh.uv[body_.mesh.uv_triangles[i / 3][k]];
    EXPECT_NEAR(uv[2 * at], coordinate.x(), 1e-6);
    EXPECT_NEAR(uv[2 * at + 1], 1 - coordinate.y(), 1e-6);
  }
}

TEST_F(Fbx, ClustersCarryAllWeightsAndTheBindPose) {
  std::vector<double> sums(body_.mesh.vertices.size(), 0.0);
  const auto clusters = all("Deformer", "Cluster");
  ASSERT_EQ(clusters.size(), avatar_.joints.size());
  for (std::size_t j = 0; j < clusters.size(); ++j) {
    const auto& indices = clusters[j]->child("Indexes").properties.at(0).numbers;
    const auto& weights = clusters[j]->child("Weights").properties.at(0).numbers;
    ASSERT_EQ(indices.size(), weights.size());
    for (std::size_t i = 0; i < indices.size(); ++i) sums.at(static_cast<std::size_t>(indices[i])) += weights[i];
    const auto& link = clusters[j]->child("TransformLink").properties.at(0).numbers;
    for (std::size_t c = 0; c < 3; ++c)
      EXPECT_NEAR(link[12 + c], 100 * avatar_.joints[j].position[static_cast<int>(c)], 1e-9);
  }
  for (const double sum : sums) EXPECT_NEAR(sum, 1.0, 1e-6);
  EXPECT_EQ(all("Pose", "BindPose").at(0)->child("NbPoseNodes").properties.at(0).integer,
            static_cast<std::int64_t>(avatar_.joints.size() + 1));
}

TEST_F(Fbx, ShapesMoveEveryVertexByItsOffset) {
  const auto shapes = all("Geometry", "Shape");
  ASSERT_EQ(shapes.size(), 1U);
  const auto& offsets = shapes[0]->child("Vertices").properties.at(0).numbers;
  ASSERT_EQ(offsets.size(), 3 * body_.mesh.vertices.size());
  double lowest = 0;
  for (const double y : offsets) lowest = std::min(lowest, y);
  EXPECT_NEAR(lowest, -1.0, 1e-6);  // a centimetre
  EXPECT_EQ(all("Deformer", "BlendShapeChannel").at(0)->child("FullWeights").properties.at(0).numbers,
            std::vector<double>{100.0});
}

TEST_F(Fbx, HoldsThePictureItself) {
  EXPECT_EQ(all("Video", "Clip").at(0)->child("Content").properties.at(0).text, std::string("\1\2"));
}

TEST_F(Fbx, CountsInCentimetresWithYUp) {
  std::map<std::string, const Record*> settings;
  for (const Record& p : root_.child("GlobalSettings").child("Properties70").children)
    settings[p.properties.at(0).text] = &p;
  EXPECT_EQ(settings.at("UnitScaleFactor")->properties.at(4).real, 1.0);
  EXPECT_EQ(settings.at("UpAxis")->properties.at(4).integer, 1);
  EXPECT_EQ(settings.at("FrontAxis")->properties.at(4).integer, 2);
}

TEST_F(Fbx, TakesANormalMapWithTheFrameOfEveryCorner) {
  for (const Record& layer : all("Geometry", "Mesh").at(0)->children) EXPECT_NE(layer.name, "LayerElementTangent");
  add_normal_map(avatar_, {std::byte{7}});
  const std::vector<std::byte> bytes = write_fbx(avatar_);
  root_ = Reader(bytes).file();
  ASSERT_EQ(all("Video", "Clip").size(), 2U);
  EXPECT_EQ(all("Video", "Clip").at(1)->child("Content").properties.at(0).text, std::string("\7"));
  const std::int64_t texture = all("Texture", "").at(1)->properties.at(0).integer;
  std::string channel;
  for (const Record& c : root_.child("Connections").children)
    if (c.properties.at(0).text == "OP" && c.properties.at(1).integer == texture) channel = c.properties.at(3).text;
  EXPECT_EQ(channel, "NormalMap");
  const Record& geometry = *all("Geometry", "Mesh").at(0);
  const auto corners = [&](const char* layer, const char* values) {
    const auto& all_numbers = geometry.child(layer).child(values).properties.at(0).numbers;
    EXPECT_EQ(all_numbers.size(), 9 * body_.mesh.triangles.size()) << layer;
    return Eigen::Map<const Eigen::Matrix3Xd>(all_numbers.data(), 3,
                                              3 * static_cast<Eigen::Index>(avatar_.triangles.size()));
  };
  const auto normals = corners("LayerElementNormal", "Normals");
  const auto tangents = corners("LayerElementTangent", "Tangents");
  const auto bitangents = corners("LayerElementBinormal", "Binormals");
  for (Eigen::Index i = 0; i < normals.cols(); ++i) {
    const Eigen::Vector3d n = normals.col(i), t = tangents.col(i), b = bitangents.col(i);
    EXPECT_NEAR(n.dot(t), 0, 1e-5);
    EXPECT_LT((n.cross(t) - b).norm(), 1e-5);  // every side of the box has its picture the right way round
  }
}

TEST_F(Fbx, IsTheSameTwice) {
  EXPECT_EQ(bytes_, write_fbx(avatar_));
}

}  // namespace
}  // namespace gyre
