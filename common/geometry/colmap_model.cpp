// SPDX-License-Identifier: Apache-2.0
#include "common/geometry/colmap_model.h"

#include <fstream>
#include <iomanip>
#include <locale>
#include <sstream>

namespace gyre {

namespace {

std::ofstream open_text(const std::filesystem::path& file) {
  std::ofstream out(file);
  out.imbue(std::locale::classic());
  out << std::setprecision(17);
  return out;
}

// Numbers of one line in the classic locale; stops at the first thing that is not a number.
std::istringstream parse_line(const std::string& line) {
  std::istringstream in(line);
  in.imbue(std::locale::classic());
  return in;
}

bool is_comment(const std::string& line) {
  return !line.empty() && line[0] == '#';
}

tl::unexpected<Error> bad_line(const std::filesystem::path& file, std::size_t number) {
  return fail("cannot understand a line of the camera model", file.string() + ":" + std::to_string(number),
              "write the model again with `gyre-offload stage cameras`");
}

Result<Camera> camera_from_parameters(const std::string& type, int width, int height, const std::vector<double>& p) {
  Camera c{.width = width, .height = height};
  const auto need = [&](std::size_t n) { return p.size() >= n; };
  if (type == "SIMPLE_PINHOLE" && need(3)) {
    c.fx = c.fy = p[0];
    c.cx = p[1];
    c.cy = p[2];
  } else if (type == "PINHOLE" && need(4)) {
    c.fx = p[0];
    c.fy = p[1];
    c.cx = p[2];
    c.cy = p[3];
  } else if ((type == "SIMPLE_RADIAL" && need(4)) || (type == "RADIAL" && need(5))) {
    c.fx = c.fy = p[0];
    c.cx = p[1];
    c.cy = p[2];
    c.k1 = p[3];
    if (type == "RADIAL") c.k2 = p[4];
  } else if ((type == "OPENCV" && need(8)) || (type == "FULL_OPENCV" && need(12))) {
    c.fx = p[0];
    c.fy = p[1];
    c.cx = p[2];
    c.cy = p[3];
    c.k1 = p[4];
    c.k2 = p[5];
    c.p1 = p[6];
    c.p2 = p[7];
    if (type == "FULL_OPENCV") {
      c.k3 = p[8];
      if (p[9] != 0 || p[10] != 0 || p[11] != 0)
        return fail("camera with a rational distortion", type, "undistort the images first");
    }
  } else {
    return fail("unknown camera type", type, "use PINHOLE, OPENCV or FULL_OPENCV");
  }
  return c;
}

}  // namespace

int ColmapModel::remove_images_without_points() {
  const auto shows_points = [](const auto& item) {
    const auto& observations = item.second.observations;
    return std::any_of(observations.begin(), observations.end(), [](const auto& o) { return o.point_id >= 0; });
  };
  if (std::none_of(images.begin(), images.end(), shows_points)) return 0;
  return static_cast<int>(std::erase_if(images, [&](const auto& item) { return !shows_points(item); }));
}

void ColmapModel::move_world(const Similarity& new_from_old) {
  for (auto& [id, image] : images) image.cam_from_world = cam_from_moved_world(image.cam_from_world, new_from_old);
  for (auto& [id, point] : points) point.position = new_from_old * point.position;
}

Result<void> write_colmap_model(const ColmapModel& model, const std::filesystem::path& folder) {
  std::ofstream cameras = open_text(folder / "cameras.txt");
  cameras << "# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]\n";
  for (const auto& [id, camera] : model.cameras) {
    const Camera& c = camera;  // clang 14 cannot capture structured bindings
    cameras << id;
    const auto head = [&](const char* type) {
      cameras << ' ' << type << ' ' << c.width << ' ' << c.height << ' ' << c.fx << ' ' << c.fy << ' ' << c.cx << ' '
              << c.cy;
    };
    if (!c.has_distortion()) {
      head("PINHOLE");
    } else {
      head(c.k3 == 0 ? "OPENCV" : "FULL_OPENCV");
      cameras << ' ' << c.k1 << ' ' << c.k2 << ' ' << c.p1 << ' ' << c.p2;
      if (c.k3 != 0) cameras << ' ' << c.k3 << " 0 0 0";
    }
    cameras << '\n';
  }

  std::ofstream images = open_text(folder / "images.txt");
  images << "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME\n# POINTS2D[] as X Y POINT3D_ID\n";
  for (const auto& [id, image] : model.images) {
    const Eigen::Quaterniond& q = image.cam_from_world.rotation;
    const Eigen::Vector3d& t = image.cam_from_world.translation;
    images << id << ' ' << q.w() << ' ' << q.x() << ' ' << q.y() << ' ' << q.z() << ' ' << t.x() << ' ' << t.y() << ' '
           << t.z() << ' ' << image.camera_id << ' ' << image.name << '\n';
    bool first = true;
    for (const ModelImage::Observation& o : image.observations) {
      images << (first ? "" : " ") << o.pixel.x() << ' ' << o.pixel.y() << ' ' << o.point_id;
      first = false;
    }
    images << '\n';
  }

  std::ofstream points = open_text(folder / "points3D.txt");
  points << "# POINT3D_ID X Y Z R G B ERROR TRACK[] as IMAGE_ID POINT2D_IDX\n";
  for (const auto& [id, p] : model.points) {
    points << id << ' ' << p.position.x() << ' ' << p.position.y() << ' ' << p.position.z();
    for (const std::uint8_t channel : p.rgb) points << ' ' << static_cast<int>(channel);
    points << ' ' << p.error;
    for (const auto& [image, index] : p.track) points << ' ' << image << ' ' << index;
    points << '\n';
  }

  cameras.close();
  images.close();
  points.close();
  if (!cameras || !images || !points)
    return fail("cannot write the camera model", folder.string(), "check the space and rights there");
  return {};
}

Result<ColmapModel> read_colmap_model(const std::filesystem::path& folder) {
  ColmapModel model;
  std::string line;
  std::size_t number = 0;

  std::ifstream cameras(folder / "cameras.txt");
  std::ifstream images(folder / "images.txt");
  std::ifstream points(folder / "points3D.txt");
  if (!cameras || !images) return fail("no camera model", folder.string(), "run the cameras stage first");

  while (std::getline(cameras, line)) {
    ++number;
    if (line.empty() || is_comment(line)) continue;
    std::istringstream in = parse_line(line);
    int id = 0;
    int width = 0;
    int height = 0;
    std::string type;
    if (!(in >> id >> type >> width >> height) || width <= 0 || height <= 0)
      return bad_line(folder / "cameras.txt", number);
    std::vector<double> parameters;
    for (double v = 0; in >> v;) parameters.push_back(v);
    Result<Camera> camera = camera_from_parameters(type, width, height, parameters);
    if (!camera) return tl::unexpected(camera.error());
    model.cameras[id] = *camera;
  }

  number = 0;
  while (std::getline(images, line)) {
    ++number;
    if (line.empty() || is_comment(line)) continue;
    std::istringstream in = parse_line(line);
    int id = 0;
    ModelImage image;
    Eigen::Quaterniond& q = image.cam_from_world.rotation;
    Eigen::Vector3d& t = image.cam_from_world.translation;
    if (!(in >> id >> q.w() >> q.x() >> q.y() >> q.z() >> t.x() >> t.y() >> t.z() >> image.camera_id) ||
        !std::getline(in >> std::ws, image.name) || q.norm() < 1e-9 || !model.cameras.contains(image.camera_id)) {
      return bad_line(folder / "images.txt", number);
    }
    q.normalize();
    ++number;
    if (std::getline(images, line)) {  // the second line of an image may be empty: no observations
      std::istringstream seen = parse_line(line);
      ModelImage::Observation o;
      while (seen >> o.pixel.x() >> o.pixel.y() >> o.point_id) image.observations.push_back(o);
    }
    model.images[id] = std::move(image);
  }

  number = 0;
  while (std::getline(points, line)) {
    ++number;
    if (line.empty() || is_comment(line)) continue;
    std::istringstream in = parse_line(line);
    std::int64_t id = 0;
    ModelPoint p;
    int r = 0;
    int g = 0;
    int b = 0;
    if (!(in >> id >> p.position.x() >> p.position.y() >> p.position.z() >> r >> g >> b >> p.error)) {
      return bad_line(folder / "points3D.txt", number);
    }
    p.rgb = {static_cast<std::uint8_t>(r), static_cast<std::uint8_t>(g), static_cast<std::uint8_t>(b)};
    std::pair<int, int> element;
    while (in >> element.first >> element.second) p.track.push_back(element);
    model.points[id] = std::move(p);
  }
  return model;
}

}  // namespace gyre
