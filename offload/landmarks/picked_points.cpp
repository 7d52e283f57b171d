// SPDX-License-Identifier: Apache-2.0
#include "offload/landmarks/picked_points.h"

#include "common/bundle/atomic_file.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace gyre {

namespace {

using nlohmann::json;

constexpr const char* remedy = "see the README for the format of picked points";

// `count` finite numbers within +-limit.
std::optional<Eigen::VectorXd> numbers(const json& list, Eigen::Index count, double limit) {
  if (!list.is_array() || static_cast<Eigen::Index>(list.size()) != count) return std::nullopt;
  Eigen::VectorXd values(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const json& value = list[static_cast<std::size_t>(i)];
    if (!value.is_number() || !(std::abs(value.get<double>()) <= limit)) return std::nullopt;
    values[i] = value.get<double>();
  }
  return values;
}

Result<PickedPoint> point_from_json(const std::string& name, const json& j) {
  PickedPoint point;
  if (!j.is_object()) return wrong_use("a picked point is not an object", name, remedy);
  for (const auto& [key, value] : j.items()) {
    if (key == "position") {
      const auto position = numbers(value, 3, 1e3);
      if (!position) return wrong_use("a picked position is not three numbers in metres", name, remedy);
      point.position = *position;
    } else if (key == "pixels" && value.is_object()) {
      for (const auto& [view, at] : value.items()) {
        const auto pixel = numbers(at, 2, 1e5);
        if (!pixel) return wrong_use("a picked pixel is not two numbers", name + " in " + view, remedy);
        point.pixels[view] = *pixel;
      }
    } else {
      return wrong_use("a picked point has a field that is not known", name + ", " + key, remedy);
    }
  }
  if (!point.position && point.pixels.empty())
    return wrong_use("a picked point has neither position nor pixels", name, remedy);
  return point;
}

}  // namespace

Result<std::map<std::string, PickedPoint>> picked_from_json(const json& j) {
  if (!j.is_object()) return wrong_use("picked points are not a JSON object", {}, remedy);
  if (const auto version = j.find("version"); version == j.end() || *version != 1)
    return wrong_use("unknown version of picked points", {}, remedy);
  const auto landmarks = j.find("landmarks");
  if (landmarks == j.end() || !landmarks->is_object()) return wrong_use("no landmarks were picked", {}, remedy);
  std::map<std::string, PickedPoint> points;
  const std::vector<std::string>& names = landmark_names();
  for (const auto& [name, value] : landmarks->items()) {
    if (std::find(names.begin(), names.end(), name) == names.end())
      return wrong_use("a picked point is not named like a landmark", name, remedy);
    auto point = point_from_json(name, value);
    if (!point) return tl::unexpected(point.error());
    points[name] = std::move(*point);
  }
  return points;
}

json to_json(const std::map<std::string, PickedPoint>& points) {
  json landmarks = json::object();
  for (const auto& [name, point] : points) {
    json j = json::object();
    if (point.position) j["position"] = {point.position->x(), point.position->y(), point.position->z()};
    for (const auto& [view, pixel] : point.pixels) j["pixels"][view] = {pixel.x(), pixel.y()};
    landmarks[name] = j;
  }
  return {{"version", 1}, {"landmarks", landmarks}};
}

Result<std::map<std::string, PickedPoint>> read_picked(const std::filesystem::path& file) {
  const auto text = read_file(file);
  if (!text) return tl::unexpected(text.error());
  auto points = picked_from_json(json::parse(*text, nullptr, false));
  if (!points) {
    Error error = points.error();
    error.where = file.string() + (error.where.empty() ? "" : ": " + error.where);
    return tl::unexpected(error);
  }
  return points;
}

Result<Detections> PickedDetector::detect(const Subject& subject, const Progress& /*progress*/) {
  constexpr double hand = 0.002;  // metres, of a point picked in space
  constexpr double click = 1.5;   // pixels, of one picked in a picture
  Detections found;
  for (const auto& [name, point] : points_) {
    if (point.position) {
      found.placed.push_back({name, *point.position, hand * hand * Eigen::Matrix3d::Identity(), source(), {}});
      continue;
    }
    bool known = false;
    for (const auto& [file, pixel] : point.pixels) {
      const auto view = std::find_if(subject.views.begin(), subject.views.end(),
                                     [&, f = file](const LandmarkView& v) { return v.name == f; });
      if (view == subject.views.end()) continue;
      known = true;
      found.pixels.push_back({name, static_cast<int>(view - subject.views.begin()), pixel, click});
    }
    if (!known) found.missing[name] = "it was picked in " + point.pixels.begin()->first + ", which has no camera";
  }
  return found;
}

}  // namespace gyre
