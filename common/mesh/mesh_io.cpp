// SPDX-License-Identifier: Apache-2.0
#include "common/mesh/mesh_io.h"

#include "common/bundle/atomic_file.h"

#include <cstring>
#include <locale>
#include <map>
#include <sstream>
#include <string_view>

namespace gyre {

namespace {

enum class PlyType { i8, u8, i16, u16, i32, u32, f32, f64 };

std::optional<PlyType> ply_type(std::string_view name) {
  static const std::map<std::string_view, PlyType> types = {
      {"char", PlyType::i8},   {"int8", PlyType::i8},     {"uchar", PlyType::u8},   {"uint8", PlyType::u8},
      {"short", PlyType::i16}, {"int16", PlyType::i16},   {"ushort", PlyType::u16}, {"uint16", PlyType::u16},
      {"int", PlyType::i32},   {"int32", PlyType::i32},   {"uint", PlyType::u32},   {"uint32", PlyType::u32},
      {"float", PlyType::f32}, {"float32", PlyType::f32}, {"double", PlyType::f64}, {"float64", PlyType::f64}};
  const auto it = types.find(name);
  return it == types.end() ? std::nullopt : std::optional(it->second);
}

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::f32;
  std::optional<PlyType> count_type;  // set for a list
};

struct PlyElement {
  std::string name;
  std::size_t count = 0;
  std::vector<PlyProperty> properties;
};

// Reads numbers one after the other from the body of a PLY, ascii or binary little endian.
class PlyBody {
 public:
  PlyBody(std::string_view bytes, bool ascii) : bytes_(bytes), ascii_(ascii) {
    if (ascii_) {
      text_.str(std::string(bytes));
      text_.imbue(std::locale::classic());
    }
  }

  std::optional<double> next(PlyType type) {
    if (ascii_) {
      double value = 0;
      if (!(text_ >> value)) return std::nullopt;
      return value;
    }
    switch (type) {
      case PlyType::i8:
        return binary<std::int8_t>();
      case PlyType::u8:
        return binary<std::uint8_t>();
      case PlyType::i16:
        return binary<std::int16_t>();
      case PlyType::u16:
        return binary<std::uint16_t>();
      case PlyType::i32:
        return binary<std::int32_t>();
      case PlyType::u32:
        return binary<std::uint32_t>();
      case PlyType::f32:
        return binary<float>();
      case PlyType::f64:
        return binary<double>();
    }
    return std::nullopt;
  }

 private:
  template <class T>
  std::optional<double> binary() {
    if (bytes_.size() < sizeof(T)) return std::nullopt;
    T value;
    std::memcpy(&value, bytes_.data(), sizeof(T));
    bytes_.remove_prefix(sizeof(T));
    return static_cast<double>(value);
  }

  std::string_view bytes_;
  std::istringstream text_;
  bool ascii_;
};

struct PlyContent {
  TriangleMesh mesh;
  std::vector<float> confidence;
  std::vector<float> deviation;
  std::vector<std::uint8_t> views;
};

tl::unexpected<Error> bad_ply(const std::filesystem::path& file, const std::string& why) {
  return fail("cannot read a PLY file", file.string() + " (" + why + ")", "write it again");
}

Result<std::vector<PlyElement>> parse_header(std::istream& in, bool* ascii, const std::filesystem::path& file) {
  std::vector<PlyElement> elements;
  std::string line;
  *ascii = false;
  while (std::getline(in, line)) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    std::istringstream words(line);
    words.imbue(std::locale::classic());
    std::string word;
    words >> word;
    if (word == "end_header") return elements;
    if (word == "format") {
      words >> word;
      if (word != "ascii" && word != "binary_little_endian") return bad_ply(file, "format " + word);
      *ascii = word == "ascii";
    } else if (word == "element") {
      PlyElement element;
      if (!(words >> element.name >> element.count)) return bad_ply(file, "an element without a count");
      elements.push_back(std::move(element));
    } else if (word == "property") {
      if (elements.empty()) return bad_ply(file, "a property before any element");
      PlyProperty property;
      words >> word;
      if (word == "list") {
        words >> word;
        property.count_type = ply_type(word);
        if (!property.count_type) return bad_ply(file, "type " + word);
        words >> word;
      }
      const std::optional<PlyType> type = ply_type(word);
      if (!type || !(words >> property.name)) return bad_ply(file, "a property of type " + word);
      property.type = *type;
      elements.back().properties.push_back(std::move(property));
    }
  }
  return bad_ply(file, "the header does not end");
}

Result<PlyContent> read_content(const std::filesystem::path& file) {
  const Result<std::string> bytes = read_file(file);
  if (!bytes) return tl::unexpected(bytes.error());
  if (!bytes->starts_with("ply")) return bad_ply(file, "it does not begin with `ply`");
  std::istringstream header(*bytes);
  bool ascii = false;
  const Result<std::vector<PlyElement>> elements = parse_header(header, &ascii, file);
  if (!elements) return tl::unexpected(elements.error());
  if (header.eof()) return bad_ply(file, "it ends with the header");
  PlyBody body(std::string_view(*bytes).substr(static_cast<std::size_t>(header.tellg())), ascii);
  const std::size_t size = bytes->size();

  PlyContent content;
  TriangleMesh& mesh = content.mesh;
  for (const PlyElement& element : *elements) {
    if (element.count > size) return bad_ply(file, "more elements than bytes");
    const bool vertices = element.name == "vertex";
    const auto has = [&](const char* name) {
      return std::any_of(element.properties.begin(), element.properties.end(),
                         [&](const PlyProperty& p) { return p.name == name; });
    };
    if (vertices) {
      mesh.vertices.resize(element.count);
      if (has("nx")) mesh.normals.resize(element.count);
      if (has("red")) mesh.colours.resize(element.count);
      if (has("confidence")) content.confidence.resize(element.count);
      if (has("std_dev")) content.deviation.resize(element.count);
      if (has("view_count")) content.views.resize(element.count);
    }
    for (std::size_t i = 0; i < element.count; ++i) {
      for (const PlyProperty& p : element.properties) {
        if (p.count_type) {
          const std::optional<double> count = body.next(*p.count_type);
          if (!count || *count < 0 || *count > 1000) return bad_ply(file, "a list of impossible length");
          std::vector<double> list;
          for (int k = 0; k < static_cast<int>(*count); ++k) {
            const std::optional<double> value = body.next(p.type);
            if (!value) return bad_ply(file, "the file is cut short");
            list.push_back(*value);
          }
          if (element.name != "face" || (p.name != "vertex_indices" && p.name != "vertex_index")) continue;
          for (const double v : list) {
            if (!(v >= 0 && v < static_cast<double>(mesh.vertices.size())))
              return bad_ply(file, "a face names a vertex that is not there");
          }
          for (std::size_t k = 2; k < list.size(); ++k) {
            mesh.triangles.emplace_back(static_cast<int>(list[0]), static_cast<int>(list[k - 1]),
                                        static_cast<int>(list[k]));
          }
          continue;
        }
        const std::optional<double> value = body.next(p.type);
        if (!value) return bad_ply(file, "the file is cut short");
        if (!vertices) continue;
        const double v = *value;
        if (p.name == "x" || p.name == "y" || p.name == "z") mesh.vertices[i][p.name[0] - 'x'] = v;
        if (p.name == "nx" || p.name == "ny" || p.name == "nz") {
          if (!mesh.normals.empty()) mesh.normals[i][p.name[1] - 'x'] = v;
        }
        const auto channel = static_cast<std::uint8_t>(std::clamp(p.type == PlyType::f32 ? 255.0 * v : v, 0.0, 255.0));
        if (!mesh.colours.empty()) {
          if (p.name == "red") mesh.colours[i][0] = channel;
          if (p.name == "green") mesh.colours[i][1] = channel;
          if (p.name == "blue") mesh.colours[i][2] = channel;
        }
        if (p.name == "confidence") content.confidence[i] = static_cast<float>(v);
        if (p.name == "std_dev") content.deviation[i] = static_cast<float>(v);
        // A comparison with NaN is false, so that it counts as no view.
        if (p.name == "view_count") content.views[i] = v > 0 ? static_cast<std::uint8_t>(std::min(v, 255.0)) : 0;
      }
    }
  }
  return content;
}

void put_float(std::string& out, double v) {
  const auto f = static_cast<float>(v);
  out.append(reinterpret_cast<const char*>(&f), sizeof f);
}

}  // namespace

Result<TriangleMesh> read_ply(const std::filesystem::path& file) {
  Result<PlyContent> content = read_content(file);
  if (!content) return tl::unexpected(content.error());
  return std::move(content->mesh);
}

Result<PointCloud> read_cloud(const std::filesystem::path& file) {
  Result<PlyContent> content = read_content(file);
  if (!content) return tl::unexpected(content.error());
  PointCloud cloud;
  cloud.points.reserve(content->mesh.vertices.size());
  for (const Eigen::Vector3d& v : content->mesh.vertices) cloud.points.push_back(v.cast<float>());
  for (const Eigen::Vector3d& n : content->mesh.normals) cloud.normals.push_back(n.cast<float>());
  cloud.colours = std::move(content->mesh.colours);
  cloud.confidence = std::move(content->confidence);
  cloud.deviation = std::move(content->deviation);
  cloud.views = std::move(content->views);
  return cloud;
}

Result<void> write_ply(const TriangleMesh& mesh, const std::filesystem::path& file) {
  std::ostringstream header;
  header.imbue(std::locale::classic());
  header << "ply\nformat binary_little_endian 1.0\nelement vertex " << mesh.vertices.size()
         << "\nproperty float x\nproperty float y\nproperty float z\n";
  if (!mesh.normals.empty()) header << "property float nx\nproperty float ny\nproperty float nz\n";
  if (!mesh.colours.empty()) header << "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  header << "element face " << mesh.triangles.size() << "\nproperty list uchar int vertex_indices\nend_header\n";
  std::string out = header.str();
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    for (int k = 0; k < 3; ++k) put_float(out, mesh.vertices[i][k]);
    if (!mesh.normals.empty()) {
      for (int k = 0; k < 3; ++k) put_float(out, mesh.normals[i][k]);
    }
    if (!mesh.colours.empty()) out.append(reinterpret_cast<const char*>(mesh.colours[i].data()), 3);
  }
  for (const Eigen::Vector3i& t : mesh.triangles) {
    out.push_back(3);
    for (int k = 0; k < 3; ++k) {
      const std::int32_t index = t[k];
      out.append(reinterpret_cast<const char*>(&index), sizeof index);
    }
  }
  return write_file(file, out);
}

Result<void> write_cloud(const PointCloud& cloud, const std::filesystem::path& file) {
  std::ostringstream header;
  header.imbue(std::locale::classic());
  header << "ply\nformat binary_little_endian 1.0\nelement vertex " << cloud.points.size()
         << "\nproperty float x\nproperty float y\nproperty float z\n";
  if (!cloud.normals.empty()) header << "property float nx\nproperty float ny\nproperty float nz\n";
  if (!cloud.colours.empty()) header << "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  if (!cloud.confidence.empty()) header << "property float confidence\n";
  if (!cloud.deviation.empty()) header << "property float std_dev\n";
  if (!cloud.views.empty()) header << "property uchar view_count\n";
  header << "end_header\n";
  std::string out = header.str();
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    for (int k = 0; k < 3; ++k) put_float(out, cloud.points[i][k]);
    if (!cloud.normals.empty()) {
      for (int k = 0; k < 3; ++k) put_float(out, cloud.normals[i][k]);
    }
    if (!cloud.colours.empty()) out.append(reinterpret_cast<const char*>(cloud.colours[i].data()), 3);
    if (!cloud.confidence.empty()) put_float(out, cloud.confidence[i]);
    if (!cloud.deviation.empty()) put_float(out, cloud.deviation[i]);
    if (!cloud.views.empty()) out.push_back(static_cast<char>(cloud.views[i]));
  }
  return write_file(file, out);
}

Result<TriangleMesh> read_obj(const std::filesystem::path& file) {
  const Result<std::string> text = read_file(file);
  if (!text) return tl::unexpected(text.error());
  TriangleMesh mesh;
  std::istringstream in(*text);
  std::string line;
  for (std::size_t number = 1; std::getline(in, line); ++number) {
    std::istringstream words(line);
    words.imbue(std::locale::classic());
    std::string word;
    words >> word;
    const auto bad = [&](const char* why) {
      return fail("cannot read an OBJ file", file.string() + ":" + std::to_string(number) + " (" + why + ")",
                  "write it again");
    };
    if (word == "v") {
      Eigen::Vector3d v;
      if (!(words >> v.x() >> v.y() >> v.z())) return bad("a vertex needs three numbers");
      mesh.vertices.push_back(v);
    } else if (word == "vt") {
      Eigen::Vector2d vt;
      if (!(words >> vt.x() >> vt.y())) return bad("a texture coordinate needs two numbers");
      mesh.uv.emplace_back(vt.x(), 1.0 - vt.y());
    } else if (word == "f") {
      std::vector<int> v;
      std::vector<int> vt;
      while (words >> word) {
        const auto resolve = [](long index, std::size_t size) {
          return static_cast<int>(index < 0 ? static_cast<long>(size) + index : index - 1);
        };
        char* rest = nullptr;
        v.push_back(resolve(std::strtol(word.c_str(), &rest, 10), mesh.vertices.size()));
        if (v.back() < 0 || v.back() >= static_cast<int>(mesh.vertices.size()))
          return bad("a face names a vertex that is not there");
        if (*rest == '/' && rest[1] != '/' && rest[1] != '\0') {
          vt.push_back(resolve(std::strtol(rest + 1, nullptr, 10), mesh.uv.size()));
          if (vt.back() < 0 || vt.back() >= static_cast<int>(mesh.uv.size()))
            return bad("a face names a texture coordinate that is not there");
        }
      }
      if (v.size() < 3) return bad("a face needs three corners");
      for (std::size_t k = 2; k < v.size(); ++k) {
        mesh.triangles.emplace_back(v[0], v[k - 1], v[k]);
        if (vt.size() == v.size()) mesh.uv_triangles.emplace_back(vt[0], vt[k - 1], vt[k]);
      }
    }
  }
  if (mesh.uv_triangles.size() != mesh.triangles.size()) {
    mesh.uv.clear();
    mesh.uv_triangles.clear();
  }
  return mesh;
}

Result<void> write_obj(const TriangleMesh& mesh, const std::filesystem::path& file) {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out.precision(9);
  for (const Eigen::Vector3d& v : mesh.vertices) out << "v " << v.x() << ' ' << v.y() << ' ' << v.z() << '\n';
  for (const Eigen::Vector2d& t : mesh.uv) out << "vt " << t.x() << ' ' << 1.0 - t.y() << '\n';
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    out << 'f';
    for (int k = 0; k < 3; ++k) {
      out << ' ' << mesh.triangles[f][k] + 1;
      if (!mesh.uv_triangles.empty()) out << '/' << mesh.uv_triangles[f][k] + 1;
    }
    out << '\n';
  }
  return write_file(file, out.str());
}

}  // namespace gyre
